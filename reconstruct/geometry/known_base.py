"""A base that was not traced: that of an earlier model ([object] model = PATH), or of a known shape."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.errors import ContactError
from palpate.mechanics.frames import tangents
from palpate.mechanics.model.model import Model
from palpate.reconstruction.steps.s2_base.boundary import Boundary


def base_of_model(model: Model, tip_radius_m: float) -> Boundary:
    """Support plane and base rim of a model whose fixed nodes lie on the support.

    Raises ContactError where the base has too few nodes.
    """
    rim = _ordered_rim(model)
    if len(rim) < 8:
        raise ContactError(
            f"the base of the model '{model.path}' has only {len(rim)} rim nodes; at least 8 are needed: "
            "reconstruct that model with a finer --mesh-size"
        )
    return base_of_rim(rim, model.support.point, model.support.normal, tip_radius_m)


def base_of_rim(rim: np.ndarray, point: np.ndarray, normal: np.ndarray, tip_radius_m: float) -> Boundary:
    """What a tracing of a rim (k, 3), in order, would give; on the plane (point, normal), m."""
    after, before = np.roll(rim, -1, axis=0), np.roll(rim, 1, axis=0)
    outward = np.cross(after - before, normal)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-300)
    outward *= np.sign(np.sum(outward * (rim - rim.mean(axis=0))))
    return Boundary(
        support_point=point,
        support_normal=normal,
        outline=rim,
        centres=rim + tip_radius_m * (outward + normal),
        points=rim,
        interval=(0, 0),
        flatness_m=0.0,
    )


def _ordered_rim(model: Model) -> np.ndarray:
    """Fixed nodes that belong to a touchable triangle as well, in order round their middle."""
    mesh = model.mesh
    corners = np.unique(mesh.touchable_surface[:, :3])
    rim = mesh.points[corners[mesh.fixed[corners]]]
    if not len(rim):
        return rim
    u, v = tangents(model.support.normal)
    offset = rim - rim.mean(axis=0)
    return rim[np.argsort(np.arctan2(offset @ v, offset @ u))]
