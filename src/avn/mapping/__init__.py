"""Maps and spatial memories of N agents, and their localisation."""
