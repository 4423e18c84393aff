"""Structured blocks for the mechanics tests."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh


@pytest.fixture(scope="session")
def box() -> Callable[..., TetMesh]:
    """The factory mechanics.shape.tetmesh.box_mesh(cells, size, grade)."""
    return box_mesh
