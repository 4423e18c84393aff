"""Frames: the device's against the object's, and the tool's as quaternions."""

from __future__ import annotations

import numpy as np


def random_frame(seed: int, height_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """(rotation (3, 3), shift (3,) m) from the object's frame to a device that stands anywhere, tilted a
    little.
    """
    rng = np.random.default_rng([seed, 991])
    yaw = rng.uniform(-np.pi, np.pi)
    tilt = np.radians(rng.uniform(0, 7))
    about = rng.uniform(-np.pi, np.pi)
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
    axis = np.array([np.cos(about), np.sin(about), 0.0])
    k = np.array([[0, 0, axis[1]], [0, 0, -axis[0]], [-axis[1], axis[0], 0]])
    lean = np.eye(3) + np.sin(tilt) * k + (1 - np.cos(tilt)) * k @ k
    shift = rng.uniform([-0.12, -0.12, -0.5e-3 * height_mm], [0.12, 0.12, 0.5e-3 * height_mm])
    return lean @ turn, shift


def axes_of(axis: np.ndarray) -> np.ndarray:
    """(n, 3, 3) rotations whose third column is the tool's axis (n, 3) and whose roll about it stays put."""
    reference = np.broadcast_to(np.array([1.0, 0.0, 0.0]), axis.shape)
    second = np.cross(axis, reference)
    second /= np.linalg.norm(second, axis=1)[:, None]
    return np.stack([np.cross(second, axis), second, axis], axis=2)


def quaternions(rotation: np.ndarray) -> np.ndarray:
    """(n, 4) unit quaternions (w, x, y, z), w >= 0, of rotations (n, 3, 3)."""
    from scipy.spatial.transform import Rotation

    q = Rotation.from_matrix(rotation).as_quat()[:, [3, 0, 1, 2]]
    return q * np.where(q[:, :1] < 0, -1.0, 1.0)
