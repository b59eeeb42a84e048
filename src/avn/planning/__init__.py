"""Planning: partial graphs, shortest paths and the belief of the source."""
