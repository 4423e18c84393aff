"""Structured blocks for the mechanics tests."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from palpate.mechanics.shape.box_mesh import box_mesh
from palpate.mechanics.shape.tetmesh import TetMesh


@pytest.fixture(scope="session")
def box() -> Callable[..., TetMesh]:
    """The factory mechanics.shape.box_mesh.box_mesh(cells, size, grade)."""
    return box_mesh
