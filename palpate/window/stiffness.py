"""Local stiffness over a surface, computed beside the session's frames."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from mechanics.tetmesh import vertex_normals
from palpate.window.worker import Worker
from render.base import Renderer

PLACES = 2500
DEPTH_M = 0.003


def local_stiffness(renderer: Renderer, tip_radius_m: float, depth_m: float = DEPTH_M) -> np.ndarray:
    """(n,) N/m: force over depth of a straight press to `depth_m` at each point of the renderer's surface.

    Pressed at about 2,500 places, and interpolated between them.
    """
    points, triangles = renderer.surface
    normals = vertex_normals(np.asarray(points, dtype=float), np.asarray(triangles))
    every = max(1, len(points) // PLACES)
    chosen = np.arange(0, len(points), every)
    values = np.empty(len(chosen))
    depths = np.concatenate([[-0.002], np.linspace(0.0, depth_m, 7)])
    for i, k in enumerate(chosen):
        state = renderer.start([tip_radius_m], dt_s=10.0)
        # by steps, whose kernel the servo has compiled already
        for tip in points[k] + (tip_radius_m - depths)[:, None] * normals[k]:
            forces = renderer.step(state, tip[None])[1]
        values[i] = max(float(forces[0] @ normals[k]), 0.0) / depth_m
    if every == 1:
        return values
    distance, near = cKDTree(points[chosen]).query(points, k=4)
    weight = 1.0 / np.maximum(distance, 1e-6)
    return (weight * values[near]).sum(axis=1) / weight.sum(axis=1)


class StiffnessMap:
    """The maps of the renderers that are drawn, new ones whenever those change."""

    def __init__(self, worker: Worker, tip_radius_m: float) -> None:
        self._worker = worker
        self._radius_m = tip_radius_m
        self._shown: tuple[Renderer, ...] = ()
        self._ready: tuple[tuple[Renderer, ...], list[np.ndarray]] | None = None

    def forget(self) -> None:
        """The maps are wanted anew."""
        self._shown, self._ready = (), None

    def of(self, renderers: tuple[Renderer, ...]) -> list[np.ndarray]:
        """(n,) N/m for each renderer, once, when they are ready; an empty list before and after."""
        if self._ready is not None:
            (shown, maps), self._ready = self._ready, None
            if _same(shown, renderers):
                self._shown = shown
                return maps
        if not _same(self._shown, renderers):

            def job() -> None:
                self._ready = renderers, [local_stiffness(r, self._radius_m) for r in renderers]

            self._worker.run("pressing every place for its stiffness", job)
        return []


def _same(a: tuple[Renderer, ...], b: tuple[Renderer, ...]) -> bool:
    return len(a) == len(b) and all(x is y for x, y in zip(a, b, strict=True))
