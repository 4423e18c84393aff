"""Frames at points of a surface: the local one, normal first, and the support's, whose third axis is up.

Both are right-handed and share their tangents, which follow from the normal alone.
"""

from __future__ import annotations

import numpy as np

_NO_LENGTH = 1e-12
"""Of what is about 1 long where it has a direction."""


def local_frames(normals: np.ndarray) -> np.ndarray:
    """(k, 3, 3) rows n, u, v of each outward unit normal (k, 3): they turn a device vector into the local
    frame."""
    normals = np.asarray(normals, dtype=float).reshape(-1, 3)
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    u = np.cross(helper, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([normals, u, np.cross(normals, u)], axis=1)


def unit_vectors(vectors: np.ndarray, instead: np.ndarray) -> np.ndarray:
    """(k, 3): vectors (k, 3) of unit length; `instead`, unit vectors, of those without length or number."""
    length = np.linalg.norm(vectors, axis=1)
    there = length > _NO_LENGTH
    result = np.array(np.broadcast_to(instead, vectors.shape), dtype=float)
    result[there] = vectors[there] / length[there, None]
    return result


def tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors u, v with n = u x v, the unit normal (3,)."""
    _, u, v = local_frames(normal)[0]
    return u, v


def support_axes(normal: np.ndarray) -> np.ndarray:
    """(3, 3), rows: unit vectors of the support's coordinates, the third along its normal (3,), made a unit
    vector."""
    up = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    return np.array([*tangents(up), up])
