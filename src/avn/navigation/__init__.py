"""Episodes, protocols, the simulator and the metrics of navigation."""
