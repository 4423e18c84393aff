"""What is dear and depends on shape and places alone is kept beside the model, keyed by its content."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from mechanics.model import Model
from mechanics.presses import Presses
from mechanics.store import content_key, load_or_build

VERSION = 1


def stored(
    name: str, model: Model, touches: Presses, build: Callable[[], Mapping[str, np.ndarray]]
) -> dict[str, np.ndarray]:
    """The arrays of a stage: from the model's folder where they are there, else of `build` and kept there.

    A model that was never written keeps nothing. Damaged or foreign files are built anew.
    """
    path = None if model.path is None else model.path / f"diagnosis-{name}.cache"
    mesh = model.mesh
    key = content_key(
        name, VERSION, mesh.points, mesh.tetrahedra, mesh.fixed, model.element_ratio,
        model.material.poisson_ratio, touches.point, touches.normal,
    )  # fmt: skip
    return load_or_build(path, key, build)
