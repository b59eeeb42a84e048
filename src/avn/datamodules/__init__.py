"""Lightning data modules of the networks."""
