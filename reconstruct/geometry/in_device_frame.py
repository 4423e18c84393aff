"""A known geometry where it lies, and the rim of its base."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.frames import support_axes
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.shape.tetmesh import TetMesh
from palpate.reconstruction.geometry.known_base import base_of_rim
from palpate.reconstruction.steps.s2_base.boundary import Boundary
from palpate.reconstruction.steps.s4_surface.surface import Surface
from palpate.reconstruction.steps.s7_modulus.shape_error import PoseError


@dataclass(frozen=True)
class Placed:
    """A known geometry in the device frame.

    surface: closed, its uncertainty that of pose and file together. local_sd_m: of the file alone. pose: its
    error, None where it is taken as given. mesh: of a slab, which needs no mesher; None for a shape. base:
    as a tracing would give it. residual_m: (k,) of the first touches. about: what model.toml keeps,
    [geometry]. notes: what the user should know, one line each. doubt: why it may be another object's, ''
    where the touches lie on it.
    """

    surface: Surface
    local_sd_m: float
    pose: PoseError | None
    mesh: TetMesh | None
    base: Boundary
    residual_m: np.ndarray
    about: dict[str, Any]
    notes: tuple[str, ...]
    doubt: str = ""

    @property
    def by_itself(self) -> Surface:
        """The surface with the file's uncertainty alone: the pose moves all of it together."""
        local = np.full(len(self.surface.vertices), self.local_sd_m)
        return dataclasses.replace(self.surface, uncertainty_m=local)


def nowhere(recording: Recording) -> Boundary:
    """A support so far below that nothing touches it, for a first look at the touches."""
    up = np.array([0.0, 0.0, 1.0])
    corners = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)
    rim = np.vstack([corners, 0.5 * corners]) + recording.position.mean(axis=0) - 1e3 * up
    return base_of_rim(rim, rim[0], up, recording.tip_radius_m)


def foot_rim(vertices: np.ndarray, triangles: np.ndarray, foot: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(k, 3) nodes of the foot that belong to a wall as well, in order round their middle."""
    low = np.abs((vertices - foot) @ up) < 1e-7
    down = low[triangles].all(axis=1)
    nodes = np.intersect1d(np.unique(triangles[down]), np.unique(triangles[~down]))
    axes = support_axes(up)
    offset = vertices[nodes] - vertices[nodes].mean(axis=0)
    return vertices[nodes][np.argsort(np.arctan2(offset @ axes[1], offset @ axes[0]))]
