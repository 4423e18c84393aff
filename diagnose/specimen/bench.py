"""Bench instruments: one place of one specimen, or one place of many, pressed in a machine that logs travel
and load.

The curves are brought to the size of a hand's tip by similarity (lengths, forces and times), which
elasticity, memory and all effects here are indifferent to; so a cantilever of an AFM, a texture analyser and
a finger are diagnosed by one machinery on a half-space or a layer. What is found is turned back into the
machine's own units.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.mechanics.contact.tip import Tip
from palpate.mechanics.errors import ContactError, OptionError
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.plausible import USUAL_POISSON_RATIO, USUAL_TIP_RADIUS_M
from palpate.mechanics.presses.segmentation import FoundAround, FoundPresses, segment_recording
from palpate.mechanics.quantities import parse_unit, unit_of_key
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.statistics import spread_about_zero
from palpate.reconstruction.geometry.slab import flat_mesh, half_space_size
from palpate.reconstruction.steps.s1_filter.noise import white_noise_std
from palpate.reconstruction.steps.s3_contacts.contact_law import Loading, first_touches

HAND_TIP_M, PEAK_N = USUAL_TIP_RADIUS_M, 1.0
"""The size to which curves are brought: tip's radius, and the force of the middle one at its peak."""
HAND_S, RATE_HZ = 2.0, 200.0
"""The pace to which they are brought: how long the middle curve takes, and readings a second at most."""
_BETWEEN_S = 2.0
_CELLS = 20
_WAY_ROWS = 60
_MARGIN = 2.0
_BASELINE = 0.1
_LEAST_NOISE = 1e-3
_STRAIGHT = 0.1
"""Share of the peak from which a root of the force is straight."""
_LINE, _FREE = 4, 3
"""Readings that a line of a way in of its own needs, and readings beyond unknowns of lines of one slope."""
_CONTACT = 8.0
"""A curve must rise above so many standard deviations of its noise."""
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class MachineCycle:
    """One cycle of a machine: t (n,) s increasing, travel (n,) m into the sample from any zero, force (n,) N
    that pushes the tip out, from any level. name: of its file. level_n: what it reads in free air; None: what
    the first rows read. own: the travel is the tip's, the instrument has taken off what its own spring does.
    """

    t: np.ndarray
    travel: np.ndarray
    force: np.ndarray
    name: str = ""
    level_n: float | None = None
    own: bool = False


@dataclass(frozen=True)
class Similarity:
    """Factors from a machine's metres, newtons and seconds to those of a hand."""

    length: float
    force: float
    time: float

    def back(self, keys: Mapping[str, Any]) -> dict[str, Any]:
        """Parameters in the machine's size: each by the powers of metres, newtons and seconds in the unit
        that its key states."""
        return {key: _times(value, 1 / self._factor(unit_of_key(key))) for key, value in keys.items()}

    def _factor(self, unit: str) -> float:
        return parse_unit(unit).factor(self.length, self.force, self.time)

    @property
    def modulus(self) -> float:
        """Factor from Pa to Pa."""
        return self._factor("Pa")


def _times(value: Any, factor: float) -> Any:
    if isinstance(value, list | tuple):
        return [_times(v, factor) for v in value]
    return float(value) * factor if isinstance(value, int | float) and not isinstance(value, bool) else value


@dataclass(frozen=True)
class Bench:
    """Curves as a recording of one place on a model, in a hand's size.

    similarity: what brought them there. onset_m: (c,) m, travel at first touch, in the machine's own zero;
    modulus_pa: (c,) Pa, of each curve's way in by itself, by the tip's first law on a half-space. used: (c,)
    bool, curves with a contact. specimens: every curve is of another piece. tip: in a hand's size.
    """

    recording: Recording
    model: Model
    similarity: Similarity
    onset_m: np.ndarray
    modulus_pa: np.ndarray
    used: np.ndarray
    specimens: bool
    tip: Tip


@dataclass(frozen=True)
class Touched:
    """Curves whose way in has a contact: kept of all (used (c,) bool), each way in as a loading of travel m
    and force N over free air, noise N, travel at first touch (k,) m with its standard error."""

    kept: list[MachineCycle]
    used: np.ndarray
    loadings: list[Loading]
    noise: float
    onset: np.ndarray
    error: np.ndarray


def touched(curves: Sequence[MachineCycle], tip: Tip) -> Touched:
    """Where each curve touches, by the power of the depth that the tip's force grows by. Raises ContactError
    where none has a contact or all have too few rows."""
    pace = _pace(curves)
    ready = [_levelled(c, pace) for c in curves]
    found = [_way_in(c) for c in ready]
    used = np.array([f is not None for f in found])
    if not used.any():
        raise ContactError(
            f"none of the {len(curves)} curves rises above its noise as the tip goes in: are travel and load "
            "the right columns, and their signs (travel into the sample, load that pushes the tip out)? say "
            "--column depth=NAME, --column load=NAME, --travel out or --compression negative"
        )
    kept = [(c, f) for c, f in zip(ready, found, strict=True) if f is not None]
    noise = float(np.median([n for _, (_, _, n) in kept]))
    loadings = [Loading(u, push, np.zeros(3), UP) for _, (u, push, _) in kept]
    if tip.form == "sphere":
        assert tip.radius_m is not None
        onset, error = _first_touches(loadings, HAND_TIP_M / tip.radius_m, noise)
    else:
        onset, error = _touches_of_power(loadings, tip.power, noise)
    return Touched([c for c, _ in kept], used, loadings, noise, onset, error)


def _first_touches(loadings: Sequence[Loading], length: float, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """m, of a sphere and their standard errors; length: to a hand's size, where the law is fitted."""
    top = float(np.median([each.push.max() for each in loadings]))
    hand = [Loading(length * each.u, each.push / top, each.origin, UP) for each in loadings]
    try:
        onset, error = first_touches(hand, noise / top)
    except ValueError as wrong:
        raise _too_few(loadings) from wrong
    return onset / length, error / length


def _touches_of_power(
    loadings: Sequence[Loading], power: float, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """m, and their standard errors, of ways in whose force grows by that power of the depth: the root of the
    force is straight, and its zero is the touch. A way in of too few rows for a line of its own takes the
    slope that all share, as those into one piece do."""
    rows = [each.push > _STRAIGHT * each.push.max() for each in loadings]
    lines = [
        (each.u[over], each.push[over] ** (1 / power)) for each, over in zip(loadings, rows, strict=True)
    ]
    counts = np.array([len(u) for u, _ in lines])
    onset, error = np.empty(len(lines)), np.empty(len(lines))
    if counts.min() < _LINE:
        onset, error = _touches_of_one_slope(loadings, lines, noise / power)
    for k in np.flatnonzero(counts >= _LINE):
        u, root = lines[k]
        (_, onset[k]), covariance = np.polyfit(root, u, 1, cov=True)
        error[k] = np.sqrt(covariance[1, 1])
    return onset, error


def _touches_of_one_slope(
    loadings: Sequence[Loading], lines: Sequence[tuple[np.ndarray, np.ndarray]], noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """m, and their standard errors, of lines (travel m, root of the force) of one slope. noise: N, over the
    power."""
    counts = np.array([len(u) for u, _ in lines])
    free = int(counts.sum()) - len(lines) - 1
    if free < _FREE:
        raise _too_few(loadings)
    u, root = (np.array([v.mean() for v in values]) for values in zip(*lines, strict=True))
    off, apart = (np.concatenate([v - v.mean() for v in values]) for values in zip(*lines, strict=True))
    width = float(apart @ apart)
    slope = float(apart @ off) / width
    by_noise = slope * max(r.max() for _, r in lines) * noise / max(each.push.max() for each in loadings)
    by_line = float(np.sqrt(((off - slope * apart) ** 2).sum() / free))
    return u - slope * root, max(by_line, by_noise) * np.sqrt(1 / counts + root**2 / width)


def _too_few(loadings: Sequence[Loading]) -> ContactError:
    in_contact = min(int((each.push > _STRAIGHT * each.push.max()).sum()) for each in loadings)
    return ContactError(
        f"on its way in a curve has {in_contact} readings over {100 * _STRAIGHT:g} % of its peak, and four "
        "are needed: press slower, or read the force more often"
    )


def _pace(curves: Sequence[MachineCycle]) -> float:
    return HAND_S / float(np.median([np.ptp(c.t) for c in curves]))


def bench_of(
    curves: Sequence[MachineCycle],
    tip: Tip,
    *,
    layer_m: float | None = None,
    poisson_ratio: float = USUAL_POISSON_RATIO,
    specimens: bool = False,
) -> Bench:
    """layer_m: thickness of the sample on its plate, None is a half-space. specimens: each curve is of
    another piece, so each force is taken over its own stiffness. Raises ContactError where no curve has a
    contact, OptionError for a layer under another tip than a sphere."""
    if layer_m is not None and tip.form != "sphere":
        raise OptionError(
            f"--layer is answered for a sphere alone, and --tip is '{tip.form}': leave --layer out, as of a "
            "deep sample"
        )
    pace, found = _pace(curves), touched(curves, tip)
    noise, used = found.noise, found.used
    deep = np.array([each.u.max() - at for each, at in zip(found.loadings, found.onset, strict=True)])
    length = HAND_TIP_M / (tip.radius_m or max(float(np.median(deep)), 1e-12))
    top = float(np.median([each.push.max() for each in found.loadings]))
    loadings = [Loading(length * each.u, each.push / top, each.origin, UP) for each in found.loadings]
    onset, error = length * found.onset, length * found.error
    hand = tip.scaled(length)
    own = np.array(
        [_modulus(each, at, hand, poisson_ratio) for each, at in zip(loadings, onset, strict=True)]
    )
    middle = float(np.median(own))
    scale = middle / own if specimens else np.ones(len(own))
    recording, times = _side_by_side(found.kept, onset, length, scale / top, noise / top)
    deepest = max(float(each.u.max() - at) for each, at in zip(loadings, onset, strict=True))
    contact = float(np.sqrt(HAND_TIP_M * max(deepest, 0.1 * HAND_TIP_M)))
    if layer_m is None:
        size = half_space_size(contact)
    else:
        thick = length * layer_m
        if deepest >= thick:
            raise ContactError(
                f"the tip goes {deepest / length:.3g} m into a layer of {layer_m:g} m: state its thickness"
            )
        wide = 2 * _MARGIN * thick + 4 * contact
        size = np.array([wide, wide, thick])
    mesh = flat_mesh(size, 0.01, _CELLS)
    at_top = np.array([0.0, 0.0, size[2]])
    rows = [slice(a, b) for a, b in times]
    peak = [rows[i].start + int(np.argmax(recording.force_on_tool[rows[i], 2])) for i in range(len(rows))]
    first = [
        r.start + int(np.argmax(recording.position[r, 2] <= HAND_TIP_M)) for r in rows
    ]  # the first row in contact
    centre = np.tile([0.0, 0.0, size[2] + HAND_TIP_M], (len(rows), 1))
    lifted = dataclasses.replace(recording, position=recording.position + at_top)
    presses = segment_recording(
        lifted,
        FoundPresses(lifted.t[first], lifted.t[peak], centre, np.tile(UP, (len(rows), 1)), error),
        FoundAround(others_s=[(lifted.t[a], lifted.t[b - 1]) for a, b in times], noise_n=noise / top),
    )
    model = Model(
        mesh=mesh.quadratic(), material=ObjectMaterial(middle, poisson_ratio),
        support=Support(np.zeros(3), UP),
        tool=Tool(HAND_TIP_M), mesh_size_m=0.01, presses=presses,
    )  # fmt: skip
    similarity = Similarity(length, 1 / top, pace)
    every = np.full((2, len(curves)), np.nan)
    every[:, used] = onset / length, own / similarity.modulus
    return Bench(lifted, model, similarity, every[0], every[1], used, specimens, hand)


def _levelled(curve: MachineCycle, pace: float) -> MachineCycle:
    """At a hand's pace, of at most RATE_HZ by means."""
    rate = (len(curve.t) - 1) / float(curve.t[-1] - curve.t[0]) / pace
    # a long hold must not thin a quick way in
    block = max(1, min(round(rate / RATE_HZ), int(np.argmax(curve.force)) // _WAY_ROWS))
    count = len(curve.t) // block
    t, travel, force = (
        v[: count * block].reshape(count, block).mean(axis=1) for v in (curve.t, curve.travel, curve.force)
    )
    return MachineCycle(pace * (t - t[0]), travel, force, curve.name, curve.level_n, curve.own)


def _way_in(curve: MachineCycle) -> tuple[np.ndarray, np.ndarray, float] | None:
    """(travel, force over the level before contact, noise N) from the start to the peak; None without a
    contact."""
    peak = int(np.argmax(curve.force))
    early = slice(0, max(3, int(_BASELINE * peak)))
    force = curve.force - _level(curve, peak)
    noise = white_noise_std(curve.force[:, None])
    if curve.level_n is None:
        noise = max(noise, spread_about_zero(force[early]) / np.sqrt(2))
    noise = max(noise, _LEAST_NOISE * float(force.max()))
    if peak < 4 or not force[peak] > _CONTACT * noise:
        return None
    return curve.travel[: peak + 1], force[: peak + 1], noise


def _level(curve: MachineCycle, peak: int) -> float:
    """N, what the curve reads in free air."""
    early = curve.force[: max(3, int(_BASELINE * peak))]
    return float(np.median(early)) if curve.level_n is None else curve.level_n


def _modulus(each: Loading, onset: float, tip: Tip, poisson_ratio: float) -> float:
    shape = tip.force(tip.laws[0], each.u - onset, 1.0, poisson_ratio)
    return float(shape @ each.push / max(shape @ shape, 1e-300))


def _side_by_side(
    curves: Sequence[MachineCycle], onset: np.ndarray, length: float, factor: np.ndarray, noise: float
) -> tuple[Recording, list[tuple[int, int]]]:
    """One recording of all curves in a hand's size, the surface at z = 0; (first, last) rows of each."""
    rate = min((len(c.t) - 1) / float(np.ptp(c.t)) for c in curves)
    times, heights, forces, spans = [], [], [], []
    clock, rows = 0.0, 0
    for curve, at, scale in zip(curves, onset, factor, strict=True):
        t = np.arange(0.0, curve.t[-1], 1 / rate)
        travel, force = (np.interp(t, curve.t, v) for v in (curve.travel, curve.force))
        peak = int(np.argmax(force))
        level = _level(MachineCycle(t, travel, force, level_n=curve.level_n), peak)
        times.append(clock + t)
        heights.append(HAND_TIP_M + at - length * travel)
        forces.append(scale * (force - level))
        spans.append((rows, rows + len(t)))
        rows += len(t)
        clock += t[-1] + _BETWEEN_S
    height, push = np.concatenate(heights), np.concatenate(forces)
    recording = Recording(
        t=np.concatenate(times),
        position=np.column_stack([0 * height, 0 * height, height]),
        force_on_tool=np.column_stack([0 * push, 0 * push, push]),
        sample_rate_hz=rate,
        tip_radius_m=HAND_TIP_M,
        force_noise_std_n=noise,
        object_name="specimen",
    )
    return recording, spans
