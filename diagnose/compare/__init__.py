"""Comparisons: FEM against interpolated 1D models on presses left out (`comparison`, `models`),
and two recordings of one object (`before_after`)."""
