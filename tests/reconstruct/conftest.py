"""Fixtures of the reconstruction's tests."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import touch_solver
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.tetmesh import TetMesh

from .exploration_of_cylinder import explore_cylinder


@pytest.fixture(scope="session")
def cylinder() -> tuple[Recording, np.ndarray]:
    """A simulated exploration of a cylinder in a tilted, shifted frame, and the times of first touch."""
    return explore_cylinder()


@pytest.fixture(scope="module")
def factorised_once() -> Iterator[None]:
    """Reconstructions whose meshes are the same share a factorisation, of the last two meshes."""
    kept: dict[tuple[bytes, float], Solver] = {}

    def shared(mesh: TetMesh, poisson_ratio: float) -> Solver:
        arrays = (mesh.points, mesh.tetrahedra, mesh.fixed, mesh.touchable)
        key = b"".join(array.tobytes() for array in arrays), poisson_ratio
        if key not in kept:
            kept[key] = touch_solver(mesh, poisson_ratio)
            while len(kept) > 2:
                del kept[next(iter(kept))]
        return kept[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("palpate.reconstruction.methods.touch_solver", shared)
        yield
