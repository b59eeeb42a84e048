"""Scene files: geometry, impulse responses and views of apartments, written and read."""
