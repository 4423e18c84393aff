"""A linear elastic body by finite elements: stiffness, its solution, how the base is held."""
