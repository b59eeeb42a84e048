"""Apartments: floor plans, their random generation, grids of cells, and surfaces."""
