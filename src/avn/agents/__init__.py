"""Agents, the loop that runs them in the simulator, and the records and traces of it."""
