"""From a device's frame to the scene's: axes, scale, clutch, and rate to position; forces go the way back.

    scene position = scale * A x_device + offset,    device force = force_scale * A^T F_scene

A is a rotation. While the clutch button is held the tip stays where it is and the offset follows the
device, as one lifts a mouse. A rate device's velocity is integrated, within a ball of `reach_m` round the
scene's centre. `step` is a pure function of its state and knows no clock.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from palpate.mechanics.bounds import FARTHEST_M, FASTEST_M_PER_S
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import Ranged, option
from palpate.mechanics.tip_state import TipState

LONGEST_RATE_STEP_S = 0.05
_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True)
class MapperOptions(Ranged):
    """How a device's motion becomes the tip's. Sign and axis come from a right-handed triple."""

    axes: str = option("x,y,z", "device axes, with signs, that give the scene's x,y,z: for example x,-z,y")
    scale: float = option(1.0, "scene metres per device metre", flag="--motion-scale")
    force_scale: float = option(1.0, "device newtons per scene newton")
    clutch_button: int = option(-1, "button that lifts the tool off the mapping; -1: none")
    reach_m: float = option(
        0.25, "how far from the scene's centre a rate device moves", unit="m", low=0.001, high=10.0
    )


def axis_matrix(axes: str) -> np.ndarray:
    """(3, 3) rotation of 'x,-z,y': row i picks the device axis that gives scene axis i.

    Raises OptionError where an axis is missing or the triple is left-handed, which would mirror every touch.
    """
    matrix = np.zeros((3, 3))
    parts = [part.strip().lower() for part in axes.split(",")]
    names = [part.lstrip("+-") for part in parts]
    if sorted(names) != ["x", "y", "z"]:
        raise OptionError(f"axes '{axes}': name each of x, y and z once, with signs, for example x,-z,y")
    for row, (part, name) in enumerate(zip(parts, names, strict=True)):
        matrix[row, _AXES[name]] = -1.0 if part.startswith("-") else 1.0
    if np.linalg.det(matrix) < 0:
        raise OptionError(f"axes '{axes}' is left-handed and would mirror the scene: change one sign")
    return matrix


@dataclass(frozen=True)
class Mapping:
    """rotation: (3, 3) device to scene. centre_m: (3,) the scene point that the device's origin maps to."""

    rotation: np.ndarray = field(default_factory=lambda: np.eye(3))
    scale: float = 1.0
    force_scale: float = 1.0
    clutch_button: int = -1
    reach_m: float = 0.25
    centre_m: np.ndarray = field(default_factory=lambda: np.zeros(3))
    rate: bool = False

    @classmethod
    def from_options(
        cls, options: MapperOptions, *, centre_m: ArrayLike = (0.0, 0.0, 0.0), rate: bool = False
    ) -> Mapping:
        """Options about a scene's centre; `rate` for a device whose control is 'rate'."""
        return cls(
            axis_matrix(options.axes),
            options.scale,
            options.force_scale,
            options.clutch_button,
            options.reach_m,
            np.asarray(centre_m, dtype=float),
            rate,
        )


@dataclass(frozen=True)
class MapperState:
    """offset_m: scene minus scaled device position. position_m: the tip, or None before the first reading."""

    offset_m: np.ndarray
    position_m: np.ndarray | None = None
    time_s: float = 0.0


def start(mapping: Mapping) -> MapperState:
    """The state before the first reading."""
    return MapperState(mapping.centre_m)


def step(mapping: Mapping, state: MapperState, raw: TipState) -> tuple[MapperState, TipState]:
    """The tip in the scene's frame. While clutched, `force_enabled` is False: command no force then.

    A reading that can be none (not finite, or far beyond every device) leaves the state and gives no place.
    """
    if not (
        np.abs(raw.position_m).max() <= FARTHEST_M and np.abs(raw.velocity_m_per_s).max() <= FASTEST_M_PER_S
    ):
        return state, replace(raw, position_m=np.full(3, np.nan), velocity_m_per_s=np.zeros(3))
    clutched = mapping.clutch_button >= 0 and bool(raw.buttons >> mapping.clutch_button & 1)
    velocity = mapping.scale * (mapping.rotation @ raw.velocity_m_per_s)
    if mapping.rate:
        position = _integrated(mapping, state, raw.time_s, velocity, clutched)
        offset = state.offset_m
    else:
        moved = mapping.scale * (mapping.rotation @ raw.position_m)
        if clutched and state.position_m is not None:
            position = state.position_m
            offset = position - moved
        else:
            offset = state.offset_m
            position = moved + offset
    tip = replace(
        raw,
        position_m=position,
        velocity_m_per_s=np.zeros(3) if clutched else velocity,
        quaternion=_turned(mapping.rotation, raw.quaternion),
        force_enabled=raw.force_enabled and not clutched,
    )
    return MapperState(offset, position, raw.time_s), tip


def _integrated(
    mapping: Mapping, state: MapperState, time_s: float, velocity: np.ndarray, clutched: bool
) -> np.ndarray:
    if state.position_m is None:
        return mapping.centre_m.copy()
    if clutched:
        return state.position_m
    # a gap in the readings must not become a leap
    duration = min(max(time_s - state.time_s, 0.0), LONGEST_RATE_STEP_S)
    away = state.position_m + velocity * duration - mapping.centre_m
    distance = float(np.linalg.norm(away))
    return mapping.centre_m + away * min(1.0, mapping.reach_m / max(distance, 1e-12))


def _turned(
    rotation: np.ndarray, quaternion: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    if (rotation == np.eye(3)).all():
        return quaternion
    w, x, y, z = quaternion
    turned = Rotation.from_matrix(rotation) * Rotation.from_quat([x, y, z, w])
    x, y, z, w = turned.as_quat()
    return (float(w), float(x), float(y), float(z))


def force_map(mapping: Mapping) -> np.ndarray:
    """(3, 3): times a force on the tool (N) in the scene's frame it is the one in the device's."""
    return mapping.force_scale * mapping.rotation.T
