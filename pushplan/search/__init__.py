"""Shortest paths on grids. Knows no robot."""
