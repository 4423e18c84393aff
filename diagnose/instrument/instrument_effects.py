"""What is found before any press is looked at: bias, drift and the tool's own weight in free air, a yielding
tool or a play on the rigid support, a move of the object between two tracings of its base.

It is taken off the forces and positions, so that the search for other effects starts from clean ones.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Collection

import numpy as np

from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.instrument.free_air import FreeAir
from palpate.diagnosis.instrument.free_air_offsets import InstrumentOffsets, around, free_air_offsets, matters
from palpate.diagnosis.instrument.readings import Readings
from palpate.diagnosis.instrument.support_readings import Move, Rigid
from palpate.diagnosis.options import AttributionOptions
from palpate.mechanics.effects.backlash import EFFECT as PLAY
from palpate.mechanics.effects.base import Effect
from palpate.mechanics.effects.force_gain import EFFECT as GAIN
from palpate.mechanics.effects.surface_offset import EFFECT as OFFSET
from palpate.mechanics.effects.tool_compliance import EFFECT as SPRING

RULES = AttributionOptions()
LEAST_PLAY_M = 5e-5
"""A narrower play on the support may be what rounding makes of it."""
PLAY_GIVES = 0.05
"""Share by which a play's width may be another than the support shows."""


def taken_off(
    readings: Readings, forward: Forward, excluded: Collection[str], rules: AttributionOptions = RULES
) -> InstrumentOffsets:
    """All that the readings assert, taken off forces and positions of forward.touches."""
    offsets = find_instrument_offsets(forward, readings.free, readings.rigid, excluded, rules)
    return with_move(offsets, forward, readings.move, excluded, rules)


def find_instrument_offsets(
    forward: Forward,
    free: FreeAir | None,
    rigid: Rigid | None,
    excluded: Collection[str],
    rules: AttributionOptions = RULES,
) -> InstrumentOffsets:
    """Decide what free air and the support show; take it off forces and positions of forward.touches."""
    offsets = free_air_offsets(forward, free, excluded, rules)
    if rigid is None or SPRING.name in excluded or rigid.compliance <= rules.z * rigid.error:
        return offsets
    t = forward.touches
    stiffness = 1 / rigid.compliance
    change = _yielding(forward, rigid.compliance)
    if not matters(forward, change, rules):
        return offsets
    forward.touches = dataclasses.replace(t, position=t.position + t.force / stiffness)
    error = np.hypot(rigid.error, SPRING.hints.systematic_share[0] * rigid.compliance)
    low, high = (1 / max(rigid.compliance + s * 1.96 * error, 1e-9) for s in (1, -1))
    why = f"on the rigid support the tip's reading gives by {1e3 * rigid.compliance:.3f} mm a newton"
    own = {"stiffness_n_per_m": float(stiffness)}, {"stiffness_n_per_m": [float(low), float(high)]}
    return offsets.also(SPRING.name, *own, change, why)


def ruled_out(
    forward: Forward, rigid: Rigid | None, move: Move | None, rules: AttributionOptions = RULES
) -> frozenset[str]:
    """What the support shows not to be there: a spring, a play or a move that is too small to matter even if
    it is `rules.z` standard errors greater than it was read."""
    gone = set()
    if rigid is not None and np.isfinite(rigid.error):
        most = max(rigid.compliance, 0.0) + rules.z * rigid.error
        if not matters(forward, _yielding(forward, most), rules):
            gone.add(SPRING.name)
    if rigid is not None and np.isfinite(rigid.play_error):
        most = abs(rigid.play) + rules.z * rigid.play_error
        if not _shows_play(rigid, rules) and not any(
            matters(forward, _played(forward, width), rules) for width in (-most, most)
        ):
            gone.add(PLAY.name)
    if move is not None:
        t = forward.touches
        along, error = move.along(t.point, t.normal)
        most = np.abs(along) + rules.z * np.sqrt(np.diag(error))
        if not matters(forward, _moved(forward, most), rules):
            gone.add(OFFSET.name)
    return frozenset(gone)


def _yielding(forward: Forward, compliance: float) -> np.ndarray:
    """(n, 3) N: what the ideal model says more where a spring of m/N has been taken off the readings."""
    t, settings = forward.touches, forward.ideal(forward.model.material.young_modulus_pa)
    read = np.nan_to_num(forward.predict(settings))
    corrected = dataclasses.replace(t, position=t.position + compliance * t.force)
    return np.nan_to_num(dataclasses.replace(forward, touches=corrected).predict(settings)) - read


def _played(forward: Forward, width: float) -> np.ndarray:
    """(n, 3) N: what the ideal model says more with a play of `width` m (mechanics.effects.backlash)."""
    settings = forward.ideal(forward.model.material.young_modulus_pa)
    here = np.nan_to_num(forward.predict(settings))
    PLAY.act(settings, np.array([np.clip(width, *(bound[0] for bound in PLAY.bounds))]), forward)
    return np.nan_to_num(forward.predict(settings)) - here


def _moved(forward: Forward, along: np.ndarray) -> np.ndarray:
    """(n, 3) N: what the ideal model says more than where its places are along (p,) m farther in."""
    settings = forward.ideal(forward.model.material.young_modulus_pa)
    here = np.nan_to_num(forward.predict(settings))
    settings.onset = settings.onset - along
    return here - np.nan_to_num(forward.predict(settings))


def with_move(
    offsets: InstrumentOffsets,
    forward: Forward,
    move: Move | None,
    excluded: Collection[str],
    rules: AttributionOptions = RULES,
) -> InstrumentOffsets:
    """The offsets, and the object's move where its base was traced twice and it shows.

    forward's surface was fitted to the same presses, so it stands where the object was pressed and nothing is
    taken off: `residual` is what the surface would miss by where its base was first traced.
    """
    if move is None or OFFSET.name in excluded:
        return offsets
    t = forward.touches
    along, error = move.along(t.point, t.normal)
    if (along**2).mean() <= rules.z**2 * np.trace(error) / len(along):
        return offsets
    change = _moved(forward, along)
    if not matters(forward, change, rules):
        return offsets
    sd = np.sqrt(np.diag(move.error))
    why = (
        f"the base traced once more lies {1e3 * np.linalg.norm(move.shift):.1f} mm and "
        f"{np.degrees(np.linalg.norm(move.turn)):.1f} degrees from where it was traced first"
    )
    parameters = {"shift_m": move.shift.tolist(), "rotation_rad": move.turn.tolist()}
    intervals = {"shift_m": around(move.shift, sd[:3]), "rotation_rad": around(move.turn, sd[3:])}
    return offsets.also(OFFSET.name, parameters, intervals, change, why)


def _shows_play(rigid: Rigid, rules: AttributionOptions) -> bool:
    return abs(rigid.play) > max(rules.z * rigid.play_error, LEAST_PLAY_M)


def seen_play(
    rigid: Rigid | None, excluded: Collection[str], rules: AttributionOptions = RULES
) -> Effect | None:
    """A play that the support shows, its width held to what was read there: a free one would widen until it
    took a solid's memory in; else None."""
    if rigid is None or PLAY.name in excluded or not _shows_play(rigid, rules):
        return None
    give = float(np.hypot(PLAY_GIVES * rigid.play, rules.z * rigid.play_error))
    known = dataclasses.replace(
        PLAY.parameters[0], low=rigid.play - give, high=rigid.play + give, starts=(rigid.play,)
    )
    return dataclasses.replace(PLAY, parameters=(known,))


def read_sideways(rigid: Rigid | None, rules: AttributionOptions = RULES) -> frozenset[str]:
    """What the support shows to be there, but not its size: a force that is read into other axes."""
    return frozenset({GAIN.name} if rigid is not None and rigid.sideways_z > rules.z else ())
