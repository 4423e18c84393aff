"""Shapes: candidates for the surface of a touched object, one file each."""
