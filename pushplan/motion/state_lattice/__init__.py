"""State lattices: motion primitives, the cells that they cover, and what those cost."""
