"""How a page holds arrays: as low-rank modes where they are smooth, in few bits, one compressed block.

What a page interpolates: presses that the renderer's own step made at every place of the surface.

At each vertex the tip goes straight in along the surface's normal, and four times aslant, as in `palpate
press` (10 mm/s, sticking). From these follow, at depths that are dense near first touch,
    force      F0(d)           of the straight press, along the normal and sideways
    sideways   M(d) = dF/ds    change of the force on the tool with a sideways move s of the tip there
and the page follows a path by F0(d) + sum of M ds, on Coulomb's cone. `Responses.channels` says how the
numbers are turned so that they may be interpolated between vertices. Where the surface bends between two
vertices, the middle of their edge is pressed too: the page interpolates quadratically there.
"""

from __future__ import annotations

import base64
import gzip
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from palpate.mechanics.frames import local_frames
from palpate.mechanics.model.model import Model
from palpate.render.base import Renderer

MOST_MODES = 40
FINEST = 3e-4
"""Step of a weight, of the size of what its table holds: a tenth of the modes' own error."""
_SIGNED, _UNSIGNED = 32767, 65535


@dataclass(frozen=True)
class Modes:
    """A table (v, c) as weights (v, r) @ basis (r, c)."""

    weights: np.ndarray
    basis: np.ndarray


def modes_of(table: np.ndarray, size: np.ndarray, error: float, most: int = MOST_MODES) -> Modes:
    """As few modes as leave errors of at most `error` of size (c,) in 999 of 1000 entries, at most `most`."""
    scaled = table / size
    _, vectors = np.linalg.eigh(scaled.T @ scaled)
    vectors = vectors[:, ::-1]
    rest = scaled.copy()
    for count in range(1, min(most, vectors.shape[1]) + 1):
        mode = vectors[:, count - 1]
        rest -= np.outer(scaled @ mode, mode)
        if np.count_nonzero(np.abs(rest) > error) <= rest.size / 1000:
            break
    basis = vectors[:, :count]
    return Modes(scaled @ basis, basis.T * size)


class PackedArrays:
    """Arrays one after another in one compressed block; `index` says where each is and how it is scaled."""

    def __init__(self) -> None:
        self.index: dict[str, dict[str, Any]] = {}
        self._parts: list[bytes] = []
        self._length = 0

    def whole(self, name: str, values: np.ndarray) -> None:
        """Whole numbers from 0 on, as they are, in 16 or 32 bits."""
        kind = "u2" if values.size == 0 or values.max() <= _UNSIGNED else "u4"
        self._add(name, values, kind)

    def floats(self, name: str, values: np.ndarray) -> None:
        """32-bit floats."""
        self._add(name, values, "f4")

    def between(self, name: str, values: np.ndarray) -> None:
        """(n, c) in 16 bits, each column between its least and greatest: an error of 8e-6 of that range."""
        low = values.min(axis=0)
        step = np.maximum(values.max(axis=0) - low, 1e-300) / _UNSIGNED
        self._add(name, np.rint((values - low) / step), "u2", low=low.tolist(), step=step.tolist())

    def around(self, name: str, values: np.ndarray) -> None:
        """(n, c) in 16 bits with a sign, each column up to its greatest size."""
        self._signed(name, values, np.maximum(np.abs(values).max(axis=0), 1e-300) / _SIGNED)

    def modes(self, name: str, modes: Modes) -> None:
        """NAME_weights in 16 bits, none finer than FINEST: a weak mode has few digits, and compresses the
        better; and NAME_basis in floats."""
        step = np.maximum(np.abs(modes.weights).max(axis=0) / _SIGNED, FINEST)
        self._signed(f"{name}_weights", modes.weights, step)
        self.floats(f"{name}_basis", modes.basis)

    def _signed(self, name: str, values: np.ndarray, step: np.ndarray) -> None:
        self._add(name, np.rint(values / step), "i2", low=[0.0] * len(step), step=step.tolist())

    def _add(self, name: str, values: np.ndarray, kind: str, **scale: list[float]) -> None:
        # column by column: neighbours are alike there, which compresses better
        data = np.ascontiguousarray(np.asarray(values).T).astype(f"<{kind}").tobytes()
        data += bytes(-len(data) % 4)
        self.index[name] = {"at": self._length, "kind": kind, "shape": list(np.shape(values)), **scale}
        self._parts.append(data)
        self._length += len(data)

    def base64(self) -> str:
        """The block, compressed by gzip (the same bytes each time)."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 9, mtime=0)).decode()


DEPTHS = 20
"""Depths of a table, dense near first touch: they go as the square of their number."""
CHANNELS = 14
SPEED_M_PER_S = 0.01
_SLOPE = 0.5
_SUBSTEPS = 3
_AIR_M = 2e-3
_BENT = float(np.cos(np.radians(4.0)))


@dataclass(frozen=True)
class Responses:
    """depths_m: (k,) greater than 0. channels: (v, k, CHANNELS), N/m; each vanishes at depth 0 with the root
    of the depth or faster: normal force over depth; sideways force over depth (3, device frame); mean
    sideways stiffness; what it differs by in each direction (6: xx, yy, zz, xy, xz, yz); change of the normal
    force with a sideways move (3). bends: (b, 2) vertices of the edges over which the surface bends;
    bend_channels: (b, k, CHANNELS) in the middles of these.
    """

    depths_m: np.ndarray
    channels: np.ndarray
    bends: np.ndarray
    bend_channels: np.ndarray


def greatest_depth(renderer: Renderer) -> float:
    """How deep a page presses, m: a tenth deeper than anyone did, at least two tip radii, to which the law of
    the dent is tabulated, and at most 0.6 of the object's height."""
    model = renderer.model
    touched = float(np.nanmax(model.presses.depth_m)) if len(model.presses) else 0.0
    height = float(model.support.height(model.mesh.points).max())
    return float(min(max(1.1 * touched, 2.0 * model.tool.tip_radius_m), 0.6 * height))


def first_depth(model: Model) -> float:
    """How deep a page presses at first, m: 4 mm under a tip of 5 mm radius, less into an object so thin that
    its support is felt."""
    height = float(model.support.height(model.mesh.points).max())
    return min(0.8 * model.tool.tip_radius_m, 0.15 * height)


def depths_of(deepest_m: float) -> np.ndarray:
    """(k,) m, those of a table."""
    return deepest_m * (np.arange(1, DEPTHS + 1) / DEPTHS) ** 2


def responses(renderer: Renderer, depths_m: np.ndarray) -> Responses:
    """The finite-element renderer's table at every vertex of its surface; those that cannot be pressed have
    that of the nearest one that can."""
    sticky, arrays = renderer.with_friction(np.inf), renderer.contact.arrays
    # what slip takes off the dent stays; the page holds the sideways force on Coulomb's cone by itself
    sticky.parameters = sticky.parameters._replace(table=renderer.parameters.table)
    vertices, bends = _pressable(renderer), _bends(renderer)
    middle = arrays.normals[bends].sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    points = np.concatenate([arrays.vertices[vertices], arrays.vertices[bends].mean(axis=1)])
    frames = local_frames(np.concatenate([arrays.normals[vertices], middle]))
    n, u, v = frames[:, 0], frames[:, 1], frames[:, 2]
    straight = pressed(sticky, points, n, np.zeros_like(n), depths_m)
    # a tip that is its radius aside of what holds it may be taken to have left the object
    slope = min(_SLOPE, 0.9 * renderer.model.tool.tip_radius_m / float(depths_m[-1]))
    per_m = []
    for axis in (u, v):
        both = [pressed(sticky, points, n, sign * slope * axis, depths_m) for sign in (1.0, -1.0)]
        gained = (both[0] - both[1]) / (2 * slope)
        per_m.append(_slopes(depths_m, gained))
    table = _channels(depths_m, straight, per_m, frames)
    own, between = np.split(table, [len(vertices)])
    good = np.isfinite(between).all(axis=(1, 2))
    return Responses(depths_m, _everywhere(own, vertices, arrays.vertices), bends[good], between[good])


def _bends(renderer: Renderer) -> np.ndarray:
    """(b, 2) vertices of the edges between places that can be pressed, over which the normal turns."""
    arrays = renderer.contact.arrays
    free = arrays.triangles[arrays.free > 0]
    edges = np.unique(
        np.sort(np.concatenate([free[:, [0, 1]], free[:, [1, 2]], free[:, [2, 0]]]), axis=1), axis=0
    )
    turned = np.einsum("ex,ex->e", *arrays.normals[edges].transpose(1, 0, 2)) < _BENT
    return edges[turned & np.isin(edges, _pressable(renderer)).all(axis=1)]


def straight_forces(renderer: Renderer, depths_m: np.ndarray) -> np.ndarray:
    """(v, k) N/m, normal force over depth of any renderer's straight presses at each vertex."""
    arrays, vertices = renderer.contact.arrays, _pressable(renderer)
    points, normals = arrays.vertices[vertices], arrays.normals[vertices]
    force = pressed(renderer, points, normals, np.zeros_like(normals), depths_m)
    table = np.einsum("pkx,px->pk", force, normals) / depths_m
    return _everywhere(table[:, :, None], vertices, arrays.vertices)[:, :, 0]


def pressed(
    renderer: Renderer, points: np.ndarray, normals: np.ndarray, slope: np.ndarray, depths_m: np.ndarray
) -> np.ndarray:
    """(p, k, 3) N on the tool at depths (k,) m of presses at points (p, 3) of the surface along its unit
    normals (p, 3), which for each metre of depth go aside by slope (p, 3); NaN where the tip met nothing."""
    radius = renderer.model.tool.tip_radius_m
    # between the depths of the table too, since what sticks remembers its way
    fine = np.interp(
        np.arange(_SUBSTEPS * len(depths_m)) + 1.0,
        _SUBSTEPS * np.arange(len(depths_m) + 1.0),
        np.concatenate([[0.0], depths_m]),
    )
    way = np.concatenate([[-_AIR_M, -1e-4], fine])
    aside = (
        np.maximum(way, 0.0)[:, None] * slope[:, None]
    )  # only once it touches: at the vertex, whatever is beside
    centre = points[:, None] + (radius - way[:, None]) * normals[:, None] + aside
    gone = np.full((len(points), 1, 3), np.nan)  # a reading that is none: what was touched is let go
    path = np.concatenate([gone, centre], axis=1)
    steps = np.concatenate([[1.0, 1.0], np.diff(way) / SPEED_M_PER_S])
    if getattr(getattr(renderer.parameters, "effects", None), "path", None) is None:
        force = _followed(renderer, path, steps)
    elif renderer.parameters.effects.path.loads[0] > 0:  # the surface remembers: each press on a fresh one
        force = np.concatenate([_followed(renderer, each[None], steps) for each in path])
    else:
        force = _followed(renderer, path, steps)
    force = force[:, 3 + _SUBSTEPS - 1 :: _SUBSTEPS]
    force[np.abs(force).max(axis=(1, 2)) == 0.0] = np.nan
    return force


def _followed(renderer: Renderer, path: np.ndarray, steps_s: np.ndarray) -> np.ndarray:
    state = renderer.start()
    flat = np.ascontiguousarray(path.reshape(-1, 1, 3))
    return renderer.follow(state, flat, np.tile(steps_s, len(path)))[:, 0].reshape(path.shape)


def _pressable(renderer: Renderer) -> np.ndarray:
    """Vertices that a tip can press: not on the rim of the base."""
    arrays = renderer.contact.arrays
    return np.setdiff1d(arrays.triangles[arrays.free > 0], arrays.triangles[arrays.free == 0])


def _slopes(depths_m: np.ndarray, force: np.ndarray) -> np.ndarray:
    """(p, k, 3) N/m, derivative by depth of forces that vanish at depth 0 about as its power 1.5."""
    depth = np.concatenate([[0.0], depths_m])
    padded = np.concatenate([np.zeros_like(force[:, :1]), force], axis=1)
    # smooth in the root of the depth, in which the table is even
    root = np.sqrt(depth)
    by_root = np.gradient(padded, root, axis=1, edge_order=2)[:, 1:]
    return by_root / (2 * root[1:, None])


def _channels(
    depths_m: np.ndarray, straight: np.ndarray, per_m: list[np.ndarray], frames: np.ndarray
) -> np.ndarray:
    n, axes = frames[:, 0], (frames[:, 1], frames[:, 2])
    p, k = straight.shape[:2]
    out = np.zeros((p, k, CHANNELS))
    normal = np.einsum("pkx,px->pk", straight, n)
    out[:, :, 0] = normal / depths_m
    out[:, :, 1:4] = (straight - normal[:, :, None] * n[:, None]) / depths_m[:, None]
    stiff = np.array([[np.einsum("pkx,px->pk", move, axis) for axis in axes] for move in per_m])
    mean = -0.5 * (stiff[0, 0] + stiff[1, 1])
    out[:, :, 4] = mean
    cross = -0.5 * (stiff[0, 1] + stiff[1, 0])
    own = (-stiff[0, 0] - mean, -stiff[1, 1] - mean)
    u, v = axes
    uv = np.einsum("pa,pb->pab", u, v)
    differs = (
        np.einsum("pk,pa,pb->pkab", own[0], u, u)
        + np.einsum("pk,pa,pb->pkab", own[1], v, v)
        + cross[:, :, None, None] * (uv + uv.transpose(0, 2, 1))[:, None]
    )
    for channel, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        out[:, :, 5 + channel] = differs[:, :, a, b]
    for move, axis in zip(per_m, axes, strict=True):
        out[:, :, 11:14] += np.einsum("pkx,px,pa->pka", move, n, axis)
    return out


def _everywhere(table: np.ndarray, vertices: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(v, ...) the table of pressed vertices at all: those without one have that of the nearest with one."""
    good = np.isfinite(table).all(axis=(1, 2))
    nearest = cKDTree(points[vertices[good]]).query(points)[1]
    everywhere = table[good][nearest]
    everywhere[vertices[good]] = table[good]
    return everywhere
