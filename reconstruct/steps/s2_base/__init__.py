"""Phase I: the base, from the path of a tip that slides around it (section 2.1)."""
