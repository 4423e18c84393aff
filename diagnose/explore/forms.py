"""Forms of a cause: what each of them does to a prediction, over its parameters and places."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.forward.touches import unobservable_effects
from palpate.mechanics.compliance.far_field import energy_fields
from palpate.mechanics.effects.base import Effect, Role
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.effects.settings import Settings
from palpate.mechanics.presses.table import Presses

Act = Callable[[Settings, Forward], None]
"""Sets one form of a cause in a prediction."""
SHARES = (0.3, 1.0, 3.0)
"""Steps from where an effect does nothing, of its starts, at which its form is taken."""
MOVES = 5
"""Steps of a parameter that is moved from where it does nothing."""
BALL_GRID_M, BALL_RADII_M, BALL_SHARE = 0.014, (0.008, 0.012), 0.5
"""Balls that are weighed: apart, radii, and the share by which a form is softer."""


def causes_tried(presses: Presses) -> list[Effect]:
    """Effects that may be the cause: those that a quick diagnosis searches for and such presses show, but for
    what can take the form of others."""
    unobservable = unobservable_effects(presses)
    able = [e for e in effects() if e.role is Role.SEARCHED and e.name not in unobservable]
    return [e for e in able if not (e.hints.any_form or e.hints.expensive)]


def forms_of(forward: Forward) -> list[tuple[str, Act]]:
    """(name, act) pairs: every form of each cause but the inclusion, whose places the object gives."""
    forms: list[tuple[str, Act]] = []
    laws: dict[str, str] = {}
    for each in causes_tried(forward.touches):
        # of the laws of one phenomenon the first stands for all
        name = laws.setdefault(each.hints.phenomenon, each.name) if each.hints.phenomenon else each.name
        if each.hints.seek is None:
            forms += [(name, _acting(each, values)) for values in _values(each)]
    return forms


def _acting(each: Effect, values: np.ndarray) -> Act:
    return lambda settings, scene: each.act(settings, values, scene)


def _values(each: Effect) -> list[np.ndarray]:
    """Of its forms: steps towards its starts, and of what starts where it does nothing each parameter moved,
    up and down."""
    low, high = each.bounds
    made: dict[bytes, np.ndarray] = {}
    for start in each.starts():
        towards = [share * (start - each.ideal) for share in SHARES]
        if not (start - each.ideal).any():
            steps = np.diag([MOVES * p.step for p in each.parameters])
            towards = [*steps, *(-steps)]
        for way in towards:
            value = np.clip(each.ideal + way, low, high)
            made.setdefault(value.round(9).tobytes(), value)
    return list(made.values())


def balls(forward: Forward) -> list[np.ndarray]:
    """(p,) 1/m each: by how much more each place gives, unit modulus, over a softer ball on a grid inside the
    object; to first order in its energy."""
    places = forward.places
    fields = energy_fields(places)
    low, high = fields.centroid.min(axis=0), fields.centroid.max(axis=0)
    axes = [np.arange(a + BALL_GRID_M / 2, b, BALL_GRID_M) for a, b in zip(low, high, strict=True)]
    centres = np.array(np.meshgrid(*axes, indexing="ij")).reshape(3, -1).T
    made = []
    for centre in centres:
        away = np.linalg.norm(fields.centroid - centre, axis=1)
        if away.min() > 0.5 * BALL_GRID_M:
            continue
        for radius in BALL_RADII_M:
            share = np.clip((radius - away) / 0.004 + 0.5, 0.0, 1.0)
            made.append(BALL_SHARE * (fields.energy[:, :, 0, 0] @ share)[places.place])
    return made


def softer(compliance: np.ndarray) -> Act:
    def act(settings: Settings, scene: Forward) -> None:
        settings.far = settings.far.copy()
        settings.far[:, 0, 0] += compliance

    return act
