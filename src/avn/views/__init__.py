"""Rendering of the agent's views: meshes, materials, light, cameras and visual features."""
