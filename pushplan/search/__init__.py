"""Graph search: A* over any lattice, heaps, shortest paths on grids. Knows no robot."""
