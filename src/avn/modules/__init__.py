"""Networks that are trained, their training recipes and metrics."""
