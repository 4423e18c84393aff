"""Tool gravity and inertia: mass beyond the sensor reads as weight and as mass times acceleration."""

import dataclasses

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.mechanics.disk.schema import FileKey
from palpate.mechanics.effects.base import Effect, Keys, Parameter, Role, Scope
from palpate.mechanics.effects.hints import SearchHints
from palpate.mechanics.effects.settings import WEIGHED, ForwardSettings, TouchedScene
from palpate.mechanics.recording.kinematics import acceleration
from palpate.mechanics.recording.recording import Recording

STANDARD_GRAVITY = 9.80665


def left_by_tare(weight_n: np.ndarray, quaternion: np.ndarray | None, share: float) -> np.ndarray:
    """(n, 3) or (3,) N, device frame: what of a weight (3,) a tare leaves; share: of it not taken off at all.

    With the tool's orientation (n, 4) recorded, scalar first, a tare holds only as the tool lay at first: the
    rest turns.
    """
    if quaternion is None:
        return share * weight_n
    turn = Rotation.from_quat(quaternion, scalar_first=True)
    return weight_n - (1 - share) * turn.apply(turn[0].inv().apply(weight_n))


def _change(settings: ForwardSettings, values: np.ndarray, scene: TouchedScene) -> None:
    mass, share = values
    weight = -mass * STANDARD_GRAVITY * scene.places.model.support.normal
    added = left_by_tare(weight, scene.quaternion, share) - mass * scene.acceleration
    settings.read(WEIGHED, lambda force: force + added)


def _correct(recording: Recording, keys: Keys) -> Recording:
    force = recording.force_on_tool + keys["mass_kg"] * acceleration(recording.t, recording.position)
    if "weight_n" in keys and recording.quaternion is not None:
        force = force - left_by_tare(np.asarray(keys["weight_n"], dtype=float), recording.quaternion, 0.0)
    return dataclasses.replace(recording, force_on_tool=force)


EFFECT = Effect(
    name="tool_gravity_inertia",
    domain="instrument",
    scope=Scope.READING,
    words="the tool's own mass is read as force",
    parameters=(
        Parameter("mass_kg", "kg", 0.0, 1.0, 0.0, (0.02, 0.02), 0.002),
        Parameter("weight_share", "1", 0.0, 1.0, 0.0, (0.0, 1.0), 0.05),
    ),
    keys={"mass_kg": FileKey(low=-5.0, high=5.0, unit="kg", required=True), "tared": FileKey(bool)},
    report=lambda values, scene, modulus_pa: {"mass_kg": float(values[0]), "tared": bool(values[1] < 0.5)},
    role=Role.FREE_AIR,
    change=_change,
    correct=_correct,
    read_as=WEIGHED,
    hints=SearchHints(
        # what smoothing does to a mass: six known ones came out 1 to 5 % large
        systematic_share=(0.03, 0.0),
    ),
)
