"""Tetrahedra inside the surface (section 2.2)."""
