"""Shapes that are known: a file, a slab, a half-space, the base of an earlier model."""
