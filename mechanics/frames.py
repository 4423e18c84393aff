"""Frames at points of a surface: the local one, normal first, and the support's, whose third axis is up.

Both are right-handed and share their tangents, which follow from the normal alone.
"""

from __future__ import annotations

import numpy as np


def local_frames(normals: np.ndarray) -> np.ndarray:
    """(k, 3, 3) rows n, u, v of each outward unit normal (k, 3): they turn a device vector into the local
    frame."""
    normals = np.asarray(normals, dtype=float).reshape(-1, 3)
    helper = np.eye(3)[np.argmin(np.abs(normals), axis=1)]
    u = np.cross(helper, normals)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return np.stack([normals, u, np.cross(normals, u)], axis=1)


def tangents(normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors u, v with n = u x v, the unit normal (3,)."""
    _, u, v = local_frames(normal)[0]
    return u, v


def support_axes(normal: np.ndarray) -> np.ndarray:
    """(3, 3), rows: unit vectors of the support's coordinates, the third along its normal (3,), made a unit
    vector."""
    up = np.asarray(normal, dtype=float) / np.linalg.norm(normal)
    return np.array([*tangents(up), up])
