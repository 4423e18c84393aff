"""From a sensor's frame and a flange to the tip's centre and the force at the tip, in the device frame.

A sensor's reading is turned by `rotation` (sensor to tool, or to device where frame = "device"), a tool frame
by the orientation; the tip's centre is the stated position plus the orientation's turn of `flange_to_tip_m`.
The weight of `mass_kg` beyond the sensor acts along -z of the device frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.importing.mapping import Column, Said
from palpate.importing.meaning import MOST_ODDS, Unclear, best, force_sense, press_scores
from palpate.mechanics.errors import RecordingError
from palpate.words import mm

GRAVITY_M_PER_S2 = 9.80665


def framed(
    position: np.ndarray, force: np.ndarray, quaternion: np.ndarray | None, said: Said, notes: list[str]
) -> tuple[np.ndarray, np.ndarray]:
    """The tip's centre and the force without the tool's weight, device frame."""
    if said.rotation is not None:
        turn = _matrix(said.rotation)
        force = force @ turn.T
        notes.append("force turned from the sensor's frame by the stated rotation")
    if said.frame == "tool" or said.flange_to_tip_m is not None:
        if quaternion is None:
            raise RecordingError(
                "a sensor in the tool's frame, or flange_to_tip_m, needs the orientation: name qw, qx, qy, qz"
            )
        turned = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
        if said.frame == "tool":
            force = turned.apply(force)
            notes.append("force turned from the tool's frame by the orientation")
        if said.flange_to_tip_m is not None:
            arm = np.asarray(said.flange_to_tip_m, dtype=float)
            if arm.shape != (3,):
                raise RecordingError(
                    f"flange_to_tip_m is {said.flange_to_tip_m}; it must be three numbers X,Y,Z"
                )
            position = position + turned.apply(arm)
            notes.append(f"tip's centre {mm(float(np.linalg.norm(arm)), '.4g')} off the stated position")
    if said.mass_kg:
        sign = -1.0 if said.force_on == "object" else 1.0
        force = force + sign * np.array([0.0, 0.0, said.mass_kg * GRAVITY_M_PER_S2])
        notes.append(f"weight of {said.mass_kg:g} kg beyond the sensor taken off")
    return position, force


def one_axis(
    z: Column, position: np.ndarray, force: np.ndarray, notes: list[str]
) -> tuple[np.ndarray, bool, float]:
    """(position with z out of the sample, whether the force is that on the tool, odds) of a machine that
    moves along z alone. Raises Unclear."""
    scores = press_scores(-position[:, 2], force[:, 2])
    signs = best({key: score for key, score in scores.items() if z.guessed or key[0] > 0})
    if not signs.sure:
        raise Unclear(
            f"whether the force is that on the tool or on the object cannot be determined from how it "
            f"changes with "
            f"'{z.name}' ({signs.words})",
            "force_on",
            ("tool", "object"),
        )
    travel, load = signs.value
    notes.append(
        f"'{z.name}' counts {'into' if travel * z.factor < 0 else 'out of'} the sample, the force is that on "
        f"the {'tool' if load > 0 else 'object'} ({signs.words})"
    )
    return position * [1.0, 1.0, float(travel)], load > 0, signs.odds


def is_on_tool(position: np.ndarray, force: np.ndarray, said: Said, notes: list[str]) -> tuple[bool, float]:
    """(whether the force is that on the tool, odds): as said, else by what a solid does. Raises Unclear."""
    sense = force_sense(position, force)
    if said.force_on is not None:
        if sense.sure and (sense.value[0] > 0) != (said.force_on == "tool"):
            other = "object" if said.force_on == "tool" else "tool"
            notes.append(
                f"WARNING: the force grows as the tip moves along it, not against it ({sense.words}): leave "
                f"--force-on {said.force_on} out, or say --force-on {other}; or is a sign wrong?"
            )
        turned = "" if said.force_on == "tool" else ": turned round"
        notes.append(f"the force is that on the {said.force_on}, as stated{turned}")
        return said.force_on == "tool", MOST_ODDS
    if not sense.sure:
        raise Unclear(
            f"whether the force is that on the tool or on the object cannot be determined from "
            f"{len(force)} rows "
            f"({sense.words})",
            "force_on",
            ("tool", "object"),
        )
    if sense.value[0] < 0:
        notes.append(
            "WARNING: the force grows as the tip moves along it, so it is taken as that on the object and "
            f"turned round ({sense.words}; --force-on tool if it is not)"
        )
    else:
        notes.append(f"the force is that on the tool ({sense.words})")
    return sense.value[0] > 0, sense.odds


def _matrix(value: Any) -> np.ndarray:
    try:
        turn = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        turn = np.zeros(0)
    if (
        turn.shape != (3, 3)
        or not np.allclose(turn @ turn.T, np.eye(3), atol=1e-3)
        or np.linalg.det(turn) < 0
    ):
        raise RecordingError("rotation must be a right-handed 3 x 3 rotation matrix, sensor to frame")
    return turn


def tared(t: np.ndarray, force: np.ndarray, said: Said, notes: list[str]) -> np.ndarray:
    """Less the mean force of a stretch in free air."""
    if said.tare_s is None:
        return force
    begin, end = said.tare_s
    inside = (t >= begin) & (t <= end)
    if inside.sum() < 3:
        raise RecordingError(
            f"tare from {begin:g} to {end:g} s holds {int(inside.sum())} samples; 3 are needed"
        )
    level = force[inside].mean(axis=0)
    notes.append(f"tared by {np.linalg.norm(level):.4g} N, the mean from {begin:g} to {end:g} s")
    return force - level
