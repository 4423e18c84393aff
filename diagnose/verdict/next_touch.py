"""What would best separate two explanations: every candidate press is predicted under both.

Candidates: the places already pressed, straight or dragged sideways, three depths, three speeds, a short or a
long hold, once or twice in a row. A press is worth the whitened distance between the two predictions, after
first touch, stiffness of the place and the other nuisances have had their say. Beside them stand three
presses on the bare support, where only a tool yields, and the base traced once more, which has moved or not.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from palpate.diagnosis.forward.planned import DEEPEST_M, Plan, pressed
from palpate.diagnosis.forward.prediction import Forward
from palpate.diagnosis.options import NuisanceOptions
from palpate.diagnosis.search.attribution import Attribution
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.fit import settings_of
from palpate.diagnosis.search.leave_one_out import JudgedSet
from palpate.diagnosis.search.naming import Score
from palpate.diagnosis.search.whiten import Whitener
from palpate.diagnosis.verdict.result import NOTHING, NextTouch, parted
from palpate.mechanics.effects.settings import ForwardSettings

DEPTHS = (0.35, 0.8, 1.2)
SPEEDS = (0.004, 0.02, 0.08)
HOLDS = (0.3, 1.5)
DRAG_M = 1.5e-3
RIGID_N, RIGID_M = 4.0, 5e-5
"""Force of a press on the support, and how far readings on something rigid scatter."""
RETRACED_M = 3e-4
"""By how much an outline that is traced twice is off, over a stretch."""
Pair = tuple[tuple[str, JudgedSet], tuple[str, JudgedSet]]
"""Two explanations: name and fit."""


def plans() -> list[Plan]:
    """All ways of pressing that are compared."""
    once = [Plan(d, v, h, 0.0, 1) for d, v, h in itertools.product(DEPTHS, SPEEDS, HOLDS)]
    dragged = [Plan(d, 0.02, 0.3, DRAG_M, 1) for d in DEPTHS]
    return [*once, *dragged, Plan(0.8, 0.02, 0.3, 0.0, 2)]


def proposed(
    search: Search, found: Attribution, names: Sequence[str], candidates: Sequence[str]
) -> NextTouch | None:
    """The press that best separates two explanations that are left open: what is named (or, too, a candidate)
    from its rival, else the two likeliest candidates, or the only one from NOTHING. Where nothing known is
    left open, what was picked or gains most from what comes nearest to it; None where there are not two."""
    pair = contenders(found, names, candidates)
    return None if pair is None else next_touch(search.forward, *pair, search.nuisance)


def contenders(found: Attribution, names: Sequence[str], candidates: Sequence[str]) -> Pair | None:
    """The two explanations that the next touch separates, as `proposed` says; each with its fit."""
    for scores, name in zip(found.steps, found.picked, strict=False):
        rival = next((c for c in candidates if c in scores and c != name), None)
        if rival is not None and name in (*names, *candidates):
            return _pair(scores, name, rival)
    last = found.steps[-1]
    left = [c for c in candidates if c in last]
    if len(left) > 1:
        return _pair(last, left[0], left[1])
    if left:
        return (left[0], last[left[0]].candidate), (NOTHING, found.final)
    ranked = sorted(found.scores.values(), key=lambda s: -s.gain)
    if len(ranked) < 2:
        return None
    first = found.picked[0] if found.picked else ranked[0].name
    return _pair(found.scores, first, next(s.name for s in ranked if s.name != first))


def _pair(scores: dict[str, Score], first: str, second: str) -> Pair:
    return (first, scores[first].candidate), (second, scores[second].candidate)


def next_touch(
    forward: Forward, first: tuple[str, JudgedSet], second: tuple[str, JudgedSet], options: NuisanceOptions
) -> NextTouch:
    """The best press to separate `first` from `second` (name, fitted candidate)."""
    best: tuple[float, float, Plan, int] | None = None
    for plan in plans():
        virtual = dataclasses.replace(forward, touches=pressed(forward, plan))
        predicted = [
            virtual.predict(settings_of(virtual, c.found.effects, c.found.values)) for _, c in (first, second)
        ]
        difference = np.nan_to_num(predicted[0] - predicted[1])  # a press that no law carries through is none
        modulus = settings_of(virtual, first[1].found.effects, first[1].found.values)
        whitener = Whitener(virtual, modulus, options)
        # what another modulus would do is taken out as well
        both = np.stack([difference, np.nan_to_num(predicted[0])], axis=2)
        gram = whitener.gram(both)
        worth = gram[:, 0, 0] - gram[:, 0, 1] ** 2 / np.maximum(gram[:, 1, 1], 1e-12)
        press = int(np.argmax(worth))
        if best is None or worth[press] > best[0]:
            rows = (virtual.touches.press == press) & virtual.touches.counted
            size = float(np.sqrt((difference[rows] ** 2).sum(axis=1).mean()))
            best = (float(worth[press]), size, plan, press)
    assert best is not None
    worth, size, plan, press = best
    again, rigid = _retrace(forward, first, second), _rigid(forward, first, second)
    # a surface that is fitted to the presses themselves moves along with them: none of them shows a move
    hidden = forward.model.fitted_to(forward.touches)
    if again is not None and (again.sigmas**2 > worth or (hidden and again.sigmas > 1)):
        return again
    if rigid is not None and rigid.sigmas**2 > worth:
        return rigid
    t = forward.touches
    direction = -t.normal[press]
    depth = min(plan.depth_m(t), DEEPEST_M)
    if plan.drag:
        direction = direction + plan.drag / depth * t.frame[press][1]
        direction = direction / np.linalg.norm(direction)
    x, y, z = map(float, t.point[press])
    towards = (float(direction[0]), float(direction[1]), float(direction[2]))
    why = _why(plan, first[0], second[0], size, np.sqrt(worth))
    return NextTouch(
        x, y, z, towards, float(depth), plan.speed, plan.hold, (first[0], second[0]), why, size,
        float(np.sqrt(worth)),
    )  # fmt: skip


def _rigid(forward: Forward, first: tuple[str, JudgedSet], second: tuple[str, JudgedSet]) -> NextTouch | None:
    """Three presses on the bare support, which only a tool that yields gives way to; None where neither
    does."""
    one, other = (_meant(forward, c).tool_compliance for _, c in (first, second))
    gives = RIGID_N * abs(one - other)
    why = (
        f"pressing the bare support three times with some {RIGID_N:g} N parts "
        f"{parted((first[0], second[0]))} most: a tool that yields reads "
        f"{1e3 * gives:.2f} mm of travel there, where nothing else does"
    )
    return _on_the_support(forward, first, second, "rigid", gives / RIGID_M, why) if gives > 0 else None


def _retrace(
    forward: Forward, first: tuple[str, JudgedSet], second: tuple[str, JudgedSet]
) -> NextTouch | None:
    """The base traced once more, which has moved or has not; None where neither says that it has."""
    one, other = (_meant(forward, c).onset for _, c in (first, second))
    moved = float(np.sqrt(((one - other) ** 2).mean()))
    why = (
        f"tracing the base once more, now, parts {parted((first[0], second[0]))} most: an object that "
        f"moved is {1e3 * moved:.1f} mm from where it was traced first"
    )
    return _on_the_support(forward, first, second, "retrace", moved / RETRACED_M, why) if moved > 0 else None


def _meant(forward: Forward, candidate: JudgedSet) -> ForwardSettings:
    """What a candidate's effects set, its first touches aside."""
    return settings_of(forward, candidate.found.effects, candidate.found.values)


def _on_the_support(
    forward: Forward,
    first: tuple[str, JudgedSet],
    second: tuple[str, JudgedSet],
    kind: str,
    sigmas: float,
    why: str,
) -> NextTouch:
    """Beside the object: a third of its reach off its foot to press, at the foot to trace."""
    support = forward.model.support
    out = forward.model.mesh.points - support.point
    out = out - (out @ support.normal)[:, None] * support.normal
    middle = out.mean(axis=0)
    rim = out[np.argmax(((out - middle) ** 2).sum(axis=1))] - middle
    x, y, z = map(float, support.point + middle + (1.4 if kind == "rigid" else 1.0) * rim)
    a, b, c = map(float, -support.normal)
    return NextTouch(
        x, y, z, (a, b, c), 0.0, SPEEDS[1], HOLDS[0], (first[0], second[0]), why, 0.0, sigmas, kind
    )


def _why(plan: Plan, first: str, second: str, size: float, sigmas: float) -> str:
    pace = {SPEEDS[0]: "slow", SPEEDS[1]: "middling", SPEEDS[2]: "fast"}[plan.speed]
    depth = {DEPTHS[0]: "shallow", DEPTHS[1]: "deep", DEPTHS[2]: "deepest"}[plan.depth]
    extra = " dragged sideways" if plan.drag else " done twice in a row" if plan.times > 1 else ""
    held = f", held {plan.hold:.1f} s" if plan.hold > 1 else ""
    return (
        f"of all presses compared, a {pace}, {depth} one{extra}{held} at this place parts "
        f"{parted((first, second))} most: typically by {size * 1e3:.0f} mN, over the whole press "
        f"{sigmas:.0f} times what noise and our own errors would do"
    )
