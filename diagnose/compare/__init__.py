"""Comparisons: FEM against interpolated 1D models on presses left out, and two recordings of one object."""
