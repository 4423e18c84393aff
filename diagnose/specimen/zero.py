"""Where a machine's zero of force lies: what it reads in free air (a bias), or that contact began before the
first row (a late contact).

A curve whose first rows already push is read in two ways: its zero is wrong by what the first rows read, or
the zero is right and the tip was in the sample already. Either is fitted to the way in by every law of the
dent, and its blocks of force are left out in turn; the late contact is named where it misses far less.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.specimen.bench import Bench, MachineCycle
from palpate.diagnosis.specimen.machine_compliance import ThinnedWay, held_out_laws
from palpate.mechanics.contact.tip import Tip
from palpate.reconstruction.steps.s1_filter.noise import white_noise_std

_PUSHES, _OFF = 0.03, 0.01
"""Share of the peak that first rows push by where a contact may be late; that a bias must have to be said."""
_GAIN, _SURE = 0.75, 4.0
"""A late contact must miss at most this share of what a wrong zero misses; a bias so many standard errors."""
_EARLY = 0.1
_AIR = 0.03


def late_contact(
    curves: Sequence[MachineCycle], poisson_ratio: float, tip: Tip
) -> tuple[list[MachineCycle], str | None]:
    """The curves, whose zero is the file's own where contact began before the first row, and words for that;
    the curves as they are, and None, where free air was recorded or the zero may as well be wrong."""
    first = [_first(c) for c in curves]
    pushing = [
        level > max(_PUSHES * float(c.force.max()), _SURE * error)
        for c, (level, error) in zip(curves, first, strict=True)
    ]
    if not curves or np.mean(pushing) < 0.5:
        return list(curves), None
    raw = [_way(c, 0.0) for c in curves]
    levelled = [_way(c, level) for c, (level, _) in zip(curves, first, strict=True)]
    modulus = _first_guess(curves[0], poisson_ratio, tip)
    late, wrong = (
        min(each.missed for each in held_out_laws(ways, poisson_ratio, tip, modulus))
        for ways in (raw, levelled)
    )
    if late > _GAIN * wrong:
        return list(curves), None
    words = (
        f"contact began before the first row, which pushes by {np.median([x for x, _ in first]):.3g} N: held "
        f"out, the force errs by {100 * late:.2g} % so and by {100 * wrong:.2g} % if that were the zero"
    )
    return [dataclasses.replace(c, level_n=0.0) for c in curves], words


def bias(curves: Sequence[MachineCycle], bench: Bench) -> tuple[float, float] | None:
    """(N, Pa): what the machine reads in free air, median of the curves, and the modulus if it were not
    taken off; None where it is not surely above a hundredth of the peak."""
    levels, top, moduli = [], [], []
    nu, tip = bench.model.material.poisson_ratio, bench.tip.scaled(1 / bench.similarity.length)
    for curve, onset in zip(curves, bench.onset_m, strict=True):
        if not np.isfinite(onset):
            continue
        peak = int(np.argmax(curve.force))
        u, force = curve.travel[: peak + 1] - onset, curve.force[: peak + 1]
        air = u < -_AIR * u[-1]
        if air.sum() < 3:
            continue
        levels.append(float(np.median(force[air])))
        top.append(float(force[-1]))
        shape = tip.force(tip.laws[0], u, 1.0, nu)
        moduli.append(float(shape @ force / max(shape @ shape, 1e-300)))
    if not levels:
        return None
    level = float(np.median(levels))
    error = float(np.std(levels)) / np.sqrt(len(levels)) + 1e-12
    noise = float(np.median([white_noise_std(c.force[:, None]) for c in curves]))
    if abs(level) < max(_OFF * float(np.median(top)), _SURE * max(error, noise / np.sqrt(3))):
        return None
    return level, float(np.median(moduli))


def _first(curve: MachineCycle) -> tuple[float, float]:
    """(N, its error): what the first rows of the way in read, where they stand still; the first of them where
    the force rises from the beginning."""
    peak = int(np.argmax(curve.force))
    early = curve.force[: max(3, int(_EARLY * peak))]
    noise = white_noise_std(curve.force[:, None])
    still = abs(float(early[-1] - early[0])) < _SURE * noise
    return (float(np.median(early)), noise) if still else (float(early[:3].mean()), noise)


def _way(curve: MachineCycle, level: float) -> ThinnedWay:
    peak = int(np.argmax(curve.force))
    return ThinnedWay.thinned(curve.travel[: peak + 1], curve.force[: peak + 1] - level)


def _first_guess(curve: MachineCycle, poisson_ratio: float, tip: Tip) -> float:
    """Pa, a first guess from the whole of the way in."""
    peak = int(np.argmax(curve.force))
    deep = max(float(np.ptp(curve.travel[: peak + 1])), 1e-12)
    return tip.guess_modulus(deep, float(np.ptp(curve.force)), poisson_ratio)
