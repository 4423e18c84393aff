"""The surface that a tip meets: its triangles, how they are searched and walked on, where touch begins."""
