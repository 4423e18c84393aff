"""A simulation's presses beside the real ones, and what of its force is named against our law."""

from __future__ import annotations

import copy
import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from palpate.diagnosis.forward.touches import LEAST_PRESSES, LEAST_ROWS, touches_of
from palpate.diagnosis.numerics.base import signal_of
from palpate.diagnosis.options import AttributionOptions
from palpate.diagnosis.other_simulator.against_law import LEAST_SHARE, Numerics, numerics_of, seen_in_samples
from palpate.diagnosis.other_simulator.declared_parameters import Stated, StatedForward
from palpate.diagnosis.other_simulator.forces import Aligned
from palpate.diagnosis.other_simulator.frame import ForceFormat
from palpate.diagnosis.other_simulator.gap_decomposition import law_at
from palpate.diagnosis.verdict.answer import Findings
from palpate.mechanics.presses.table import MARGIN_S, Presses
from palpate.mechanics.progress import Progress
from palpate.render.replay import rms_n

if TYPE_CHECKING:
    from palpate.diagnosis.other_simulator.own_flaws import Own


@dataclasses.dataclass
class Sides:
    """The simulation's presses beside the real ones. forward: of all its presses, with the mended signal;
    raw: (n, 3) N, local, the force as it came; rows: of the real touches; fell_s: (p,) s, from when on the
    tip had fallen through, inf where it did not; seen: what the samples themselves showed; frame: how
    the file writes its forces; coarse: that its rows are too far apart, in words, or ''."""

    forward: StatedForward
    raw: np.ndarray
    rows: np.ndarray
    fell_s: np.ndarray
    seen: dict[str, dict[str, float]]
    notes: tuple[str, ...]
    frame: ForceFormat = dataclasses.field(default_factory=ForceFormat)
    coarse: str = ""


def pair_forces(given: Aligned, findings: Findings, stated: Stated) -> Sides:
    """The forces as touches, row by row beside the real ones."""
    presses, met = findings.readings.presses, findings.readings.met
    run = np.flatnonzero(given.usable)
    own = presses.rows(run)
    signal, seen = seen_in_samples(signal_of(presses.of(run), given.force[own]))
    force = given.force.copy()
    force[own] = signal.force

    def touches(force: np.ndarray) -> Presses:
        nothing = np.zeros_like(force)
        return touches_of(dataclasses.replace(presses, force=force, free_air=nothing).of(met))

    raw, mended = touches(given.force), touches(force)
    keep = np.isin(raw.onset_s, presses.onset_s[given.usable])
    fell_s = np.full(len(presses), np.inf)
    np.minimum.at(fell_s, presses.press[own][signal.left], signal.t[signal.left])
    real = findings.forward
    rows = raw.rows(np.flatnonzero(keep))
    forward = StatedForward(mended, real.places, stated, exact=real.exact).of(keep)
    fell_s = fell_s[np.searchsorted(presses.onset_s, forward.touches.onset_s)]
    keys = {name: values for name, (_, values) in seen.items()}
    return Sides(forward, raw.local_force[rows], rows, fell_s, keys, given.notes, given.frame, given.coarse)


def named_numerics(
    sides: Sides, rules: AttributionOptions, progress: Progress, own: Own | None = None
) -> Numerics:
    """What is named against the law; beside what the simulator has of its own, where that is known, which
    goes into the force of all together."""
    if own is None:
        return _named(sides, rules, progress)
    without = _without(sides, own)
    found, times = _named(without, rules, progress, own), own.times()
    force = {name: times * each for name, each in found.force.items()}
    force["all"] = found.force["all"] + sides.raw - without.raw
    return dataclasses.replace(found, force=force)


def _without(sides: Sides, own: Own) -> Sides:
    """The same without what the simulator has of its own."""
    forward = copy.copy(sides.forward)
    t = forward.touches
    local = own.without(t.local_force)
    turned = np.einsum("nij,ni->nj", t.frame[t.press], local)
    forward.touches = dataclasses.replace(t, force=turned)
    # what samples lost is the same beside any law
    return dataclasses.replace(sides, forward=forward, raw=local + sides.raw - t.local_force)


def _named(sides: Sides, rules: AttributionOptions, progress: Progress, own: Own | None = None) -> Numerics:
    """What is named against the law. Presses that the tip fell through have a say until they did, where that
    is long enough, and get the law's force with what was named from there on."""
    forward, t = sides.forward, sides.forward.touches
    until = np.minimum(t.end_s, sides.fell_s - MARGIN_S)
    cut = dataclasses.replace(t, end_s=until)
    seen = np.bincount(t.press[(t.t > t.onset_s[t.press]) & cut.counted], minlength=len(t))
    held = np.isinf(sides.fell_s) | (seen >= LEAST_ROWS)
    if held.sum() < LEAST_PRESSES:
        cut, held = t, np.ones(len(t), bool)
    sides = dataclasses.replace(sides, fell_s=np.where(held, sides.fell_s, -np.inf))
    if held.all() and np.isinf(sides.fell_s).all():
        return _with_seen(sides, numerics_of(forward, rules, progress, beside_own=own is not None), own)
    of_held = dataclasses.replace(forward, touches=cut).of(held)
    found = numerics_of(of_held, rules, progress, beside_own=own is not None)
    return _with_seen(sides, _over_all(sides, found, held), own)


def _over_all(sides: Sides, found: Numerics, held: np.ndarray) -> Numerics:
    """The same over all presses: those that had no say have our law's force."""
    forward, t = sides.forward, sides.forward.touches
    rows = t.rows(np.flatnonzero(held))
    law = law_at(forward, forward.stated, found)
    together = law.copy()
    together[rows] = found.with_numerics
    force = {}
    for name, own in found.force.items():
        force[name] = np.zeros_like(law)
        force[name][rows] = own
    return dataclasses.replace(found, law=law, with_numerics=together, force=force)


def _with_seen(sides: Sides, found: Numerics, own: Own | None) -> Numerics:
    """With what the samples themselves showed, where it matters: as far as it exceeds what the simulator's
    own do at its best."""
    t = sides.forward.touches
    fell = t.t >= sides.fell_s[t.press]
    mended = np.where(fell[:, None], found.with_numerics, t.local_force)
    parts = {
        "lost_contact": np.where(fell[:, None], 0.0, sides.raw - t.local_force),
        "tunnelling": np.where(fell[:, None], sides.raw - found.with_numerics, 0.0),
    }
    typical = rms_n(mended[t.counted])
    known = None if own is None else own.numerics
    its_own = {n: rms_n(known.force[n][t.counted]) for n in parts if n in known.named} if known else {}
    sizes = {n: rms_n(f[t.counted]) - its_own.get(n, 0.0) for n, f in parts.items()}
    named = [n for n in sides.seen if sizes[n] > LEAST_SHARE * typical]
    together = [n for n in sides.seen if n in its_own or n in named]
    all_of = found.force["all"] + sum((parts[n] for n in together), np.zeros_like(mended))
    strength = {n: float((found.force[n][t.counted] ** 2).sum()) for n in found.named}
    strength |= {n: sizes[n] ** 2 * t.counted.sum() for n in named}
    order = tuple(sorted(strength, key=lambda n: -strength[n]))
    # a tip that is never felt at a place may go between nodes there
    between = "tunnelling" in named and sides.seen["tunnelling"]["never_felt"] > 0
    rivals = ("contact_nodes",) if between and "contact_nodes" not in order else ()
    return dataclasses.replace(
        found,
        named=order,
        candidates=(*found.candidates, *(r for r in rivals if r not in found.candidates)),
        keys={**found.keys, **sides.seen},
        probability={**found.probability, **{n: 1.0 if n in named else 0.0 for n in sides.seen}},
        force={**found.force, **{n: parts[n] for n in sides.seen}, "all": all_of},
    )
