"""Tetrahedra and triangles: meshes, the places nearest on them, the faces that they stand for."""
