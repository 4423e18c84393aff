"""What stands in a page of a model: geometry, tables, modes of the far field, measured presses; and
what its scripts are given."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from palpate.devices.codecs import spacemouse
from palpate.exporting.page.tables import (
    PackedArrays,
    depths_of,
    first_depth,
    greatest_depth,
    modes_of,
    responses,
    straight_forces,
)
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.errors import ModelError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import modulus_share, place_numbers, rendered_share
from palpate.render.registry import create
from palpate.show.light import lit

ONE_D = "hunt-crossley"
ERROR = 0.003
"""Of the mean force at a depth, by which the modes of a table may be off."""
SHOWN_MODES, SHOWN_ERROR = 64, 0.01
"""Of the far field as it is drawn: most modes, and the share of the compliance that they may leave out."""
CURVE_POINTS = 48
_NO_SLIP = 1e9
_SIDEWAYS = 0.5
"""How far a press goes aside for each metre of depth when errors of sideways stiffness are weighed."""


def contents(renderer: FemRenderer, progress: Progress = silent) -> tuple[PackedArrays, dict[str, Any]]:
    """The arrays of a page, and what its scripts are given of the model."""
    model, arrays = renderer.model, renderer.contact.arrays
    depths = depths_of(greatest_depth(renderer))
    block = PackedArrays()
    block.between("vertices", arrays.vertices)
    block.around("normals", arrays.normals)
    seen = lit(arrays.vertices, arrays.triangles, arrays.free > 0)
    block.whole("seen_at", seen.at)
    block.whole("seen_triangles", seen.triangles)
    block.around("seen_normals", seen.normals)
    block.whole("free", arrays.free)
    progress("page: forces", 0.1)
    table = responses(renderer, depths)
    sizes = np.repeat(table.channels[:, :, :1].mean(axis=0), table.channels.shape[2], axis=1)
    sizes[:, 4:] /= _SIDEWAYS
    both = np.concatenate([table.channels, table.bend_channels])
    modes = modes_of(_flat(both), sizes.ravel(), ERROR)
    # of a bend: what its middle differs by from the mean of its ends
    modes.weights[len(table.channels) :] -= modes.weights[table.bends].mean(axis=1)
    block.modes("response", modes)
    block.whole("bends", table.bends)
    progress("page: forces", 0.6)
    beside = one_d_renderer(model)
    if beside is not None:
        curves = straight_forces(beside, depths)
        block.modes("one_d", modes_of(curves, curves.mean(axis=0), ERROR))
    band = force_band(renderer, depths)
    block.modes("band", modes_of(band, band.mean(axis=0), 0.02))
    _far(block, renderer)
    presses = _measured(block, model.presses)
    progress("page: forces", 1.0)
    return block, {
        **about(renderer, depths),
        "one_d": None if beside is None else ONE_D,
        "presses": {**presses, "word": press_word(model)},
        "arrays": block.index,
    }


def _flat(table: np.ndarray) -> np.ndarray:
    return table.reshape(len(table), -1)


@lru_cache(maxsize=1)
def one_d_renderer(model: Model) -> Renderer | None:
    """The interpolated 1D model of the page, None where the model's presses hold no parameters of it."""
    if not len(model.presses):
        return None
    try:
        return create(ONE_D, model)
    except ModelError:
        return None


def press_word(model: Model) -> str:
    """What the model's presses are: measured, or virtual where nobody touched the object of a scene."""
    return "virtual" if model.untouched else "measured"


def about(renderer: FemRenderer, depths_m: np.ndarray) -> dict[str, Any]:
    """Numbers of the model, SI, device frame."""
    model = renderer.model
    low, high = model.material.young_modulus_ci95_pa
    friction = float(renderer.parameters.friction[0])
    return {
        "name": model.name,
        "young_modulus_pa": model.material.young_modulus_pa,
        "young_modulus_ci95_pa": [low, high] if np.isfinite([low, high]).all() else None,
        "poisson_ratio": model.material.poisson_ratio,
        "tip_radius_m": model.tool.tip_radius_m,
        "friction": friction if np.isfinite(friction) else _NO_SLIP,
        "support_point": model.support.point.tolist(),
        "support_normal": model.support.normal.tolist(),
        "depths_m": depths_m.tolist(),
        "first_depth_m": first_depth(model),
        "spacemouse": {
            "full_scale": spacemouse.FULL_SCALE,
            "products": [[vendor, each] for vendor, all_ in spacemouse.PRODUCTS.items() for each in all_],
            "reports": spacemouse_reports(),
        },
    }


def spacemouse_reports() -> list[dict[str, Any]]:
    """How a SpaceMouse's input reports are read, found out by asking the codec: for each report id and least
    length in bytes (without the id) what each value is: at (first byte), of (translation or rotation), axis,
    sign.
    """
    found = []
    for report, length in ((1, 12), (1, 6), (2, 6)):
        fields = []
        for at in range(0, length, 2):
            data = bytearray(1 + length)
            data[0] = report
            data[1 + at : 3 + at] = int(spacemouse.FULL_SCALE).to_bytes(2, "little")
            moved = spacemouse.decode(bytes(data), spacemouse.Deflection())
            for of, values in (("translation", moved.translation), ("rotation", moved.rotation)):
                fields += [
                    {"at": at, "of": of, "axis": axis, "sign": value}
                    for axis, value in enumerate(values)
                    if value
                ]
        found.append({"report": report, "bytes": length, "fields": fields})
    return found


def _far(block: PackedArrays, renderer: FemRenderer) -> None:
    """Modes by which a force moves the mesh's corners, U U^T / E, and how each vertex hangs on three of
    them."""
    compliance, contact = renderer.whole_compliance, renderer.contact
    number = np.full(len(renderer.model.mesh.points), len(compliance.nodes))
    number[compliance.nodes] = np.arange(len(compliance.nodes))
    modes = shown_modes(compliance)
    block.around("far", modes.reshape(-1, modes.shape[2]))
    block.whole("nodes", number[contact.nodes])
    block.between("node_weights", contact.node_weights)


def shown_modes(compliance: SurfaceCompliance) -> np.ndarray:
    """(t, 3, r) 1/m^0.5, unit modulus: the displacement of corner i for a force on corner j is nearly
    modes[i] @ modes[j].T."""
    t = len(compliance.nodes)
    if len(compliance.factor):
        wide = compliance.factor.reshape(3 * t, -1).astype(float)
        values, vectors = np.linalg.eigh(wide.T @ wide)
        vectors = wide @ vectors / np.sqrt(np.maximum(values, 1e-300))
    else:
        square = compliance.blocks.transpose(0, 2, 1, 3).reshape(3 * t, 3 * t).astype(float)
        values, vectors = np.linalg.eigh(0.5 * (square + square.T))
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    left_out = 1 - np.cumsum(values) / values.sum()
    count = min(int(np.searchsorted(-left_out, -SHOWN_ERROR)) + 1, SHOWN_MODES, len(values))
    return (vectors[:, :count] * np.sqrt(values[:count])).reshape(t, 3, count)


def _measured(block: PackedArrays, presses: Presses) -> dict[str, Any]:
    """The measured presses: where they met the surface and, where samples are kept, force along the normal
    over depth, on the way in and out."""
    block.floats("press_points", presses.point)
    block.floats("press_normals", presses.normal)
    starts, depths, forces = [0], [], []
    if presses.sampled:
        net = presses.net
        for p, part in enumerate(net.parts):
            inside = (net.t[part] >= net.onset_s[p]) & (net.t[part] <= net.end_s[p])
            depth, force = net.depth[part][inside], net.push[part][inside]
            some = _thinned(depth, force)
            depths.append(some[0])
            forces.append(some[1])
            starts.append(starts[-1] + len(some[0]))
    block.floats("press_depth", np.concatenate(depths) if depths else np.zeros(0))
    block.floats("press_force", np.concatenate(forces) if forces else np.zeros(0))
    return {"count": len(presses), "starts": starts if len(starts) > 1 else [0] * (len(presses) + 1)}


def _thinned(depth_m: np.ndarray, force_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means over runs of rows, CURVE_POINTS at most."""
    parts: Sequence[np.ndarray] = [
        rows
        for rows in np.array_split(np.arange(len(depth_m)), min(CURVE_POINTS, max(len(depth_m), 1)))
        if len(rows)
    ]
    means = [np.array([values[rows].mean() for rows in parts]) for values in (depth_m, force_n)]
    return means[0], means[1]


def force_band(renderer: FemRenderer, depth_m: np.ndarray) -> np.ndarray:
    """(v, k) 95 % half width of the force over the force, at the v vertices of the renderer's surface and
    depths (k,) m.

    The model's interval of its modulus and the law's own error (render.force_error), taken as independent.
    """
    radius = renderer.model.tool.tip_radius_m
    numbers = place_numbers(renderer, radius)[:, :, None]
    return np.hypot(modulus_share(renderer.model), rendered_share(renderer, depth_m / radius, numbers))
