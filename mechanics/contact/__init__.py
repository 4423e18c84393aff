"""One touch: the dent's law and what rims and bases change of it, the force along a path."""
