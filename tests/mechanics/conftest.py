"""Structured blocks for the mechanics tests."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from mechanics.box_mesh import box_mesh
from mechanics.tetmesh import TetMesh

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="session")
def box() -> Callable[..., TetMesh]:
    """The factory mechanics.box_mesh.box_mesh(cells, size, grade)."""
    return box_mesh
