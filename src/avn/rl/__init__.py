"""Reinforcement learning: the environment, the actor-critic networks and A3C."""
