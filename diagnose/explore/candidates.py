"""How well a press would separate two causes, by the way in which it is made.

Every place that was pressed is pressed once more in thought, by each plan, under the likeliest form of the
likeliest cause and of its rivals. What is left of the difference beside noise, first touch, stiffness of the
place and the modulus is the expected gain in log evidence.

Where the tip can go next, and which touch makes the most progress a second.

Two uncertainties are predicted forward: the surface's standard deviation (a touch takes away what it shares
with its surroundings, by the correlation length of shape errors), and the modulus's (presses are replicates
with a part that neighbours share and a part of their own). The worth of a touch is its progress a second, in
logarithms, towards all goals that are still missed. A shallow press shows little of the modulus: an error of
first touch is a greater share of its depth.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.diagnosis.explore.causes import Causes, likeliest
from palpate.diagnosis.explore.goals import GoalState, off_support, surface_error
from palpate.diagnosis.explore.weighing import NUISANCE, SUPPORT_GIVES, Weighing, changed
from palpate.diagnosis.forward.planned import Plan, pressed
from palpate.diagnosis.search.whiten import Whitener
from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.effects.tool_compliance import EFFECT as TOOL_COMPLIANCE
from palpate.mechanics.law_errors import FirstTouch, Stiffness
from palpate.mechanics.options import option
from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.mechanics.statistics import squared_exponential
from palpate.reconstruction.shapes.outline import farthest_points
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s4_surface import Surface
from palpate.reconstruction.steps.s7_modulus.shape_error import CORRELATION_M

PLANS = (
    Plan(0.8, 0.02, 0.2, 0.0, 1),
    Plan(0.8, 0.08, 0.2, 0.0, 1),
    Plan(0.8, 0.005, 0.2, 0.0, 1),
    Plan(0.8, 0.06, 1.5, 0.0, 1),
    Plan(0.35, 0.02, 0.2, 0.0, 1),
)
"""Ways of pressing that are compared; depths as shares of the greatest so far, m/s, s."""
RIVALS = 2
RIGID_S = 6.0
"""What three presses on the bare support take."""
SPRING = TOOL_COMPLIANCE.name


@dataclass(frozen=True)
class Separation:
    """What a plan would show. gain: (p,) expected log evidence of the likeliest cause against its rivals, at
    each place that was pressed (point (p, 3) m, device frame), never more than is missing."""

    plan: Plan
    depth_m: float
    point: np.ndarray
    gain: np.ndarray
    first: str
    rival: str

    def near(self, point: np.ndarray) -> float:
        """The gain at the pressed place that is nearest to a point (3,) m."""
        return float(self.gain[np.argmin(((self.point - point) ** 2).sum(axis=1))])


def separations(weighing: Weighing, causes: Causes, at: float) -> list[Separation]:
    """What each plan would show of the likeliest cause against those that are not ruled out beside it."""
    first, *others = causes.not_ruled_out(at)
    rivals = others[:RIVALS]
    if not rivals:
        return []
    w, made = weighing, []
    over = w.inflation(causes.misfit)
    forms = {name: likeliest(w, name, causes.least_n) for name in (first, *rivals)}
    for plan in PLANS:
        virtual = dataclasses.replace(w.forward, touches=pressed(w.forward, plan))
        before = changed(virtual, w.found, None)
        change = {}
        for name, form in forms.items():
            change[name] = np.zeros_like(before)
            if form is not None:
                change[name] = form[1] * (changed(virtual, w.found, form[0]) - before)
        ideal = virtual.ideal(float(np.exp(w.found.values[0])))
        whitener = Whitener(virtual, ideal, NUISANCE, w.site_sd, w.whitener.onset_sd)
        gain = np.zeros(len(virtual.touches))
        for rival in rivals:
            both = np.stack([change[first] - change[rival], before], axis=2)
            gram = whitener.gram(both)
            left = gram[:, 0, 0] - gram[:, 0, 1] ** 2 / np.maximum(gram[:, 1, 1], 1e-12)
            gain += np.minimum(0.5 * left / over, causes.missing(rival, at))
        touches = w.forward.touches
        made.append(Separation(plan, plan.depth_m(touches), touches.point, gain, first, rivals[0]))
    return made


def support_gain(weighing: Weighing, causes: Causes, at: float) -> tuple[float, str, str]:
    """(expected log evidence, likeliest cause, rival) of three presses on the bare support; 0 where no
    yielding tool is in question."""
    first, *others = causes.not_ruled_out(at)
    pair = [n for n in (first, *others[:RIVALS]) if n != SPRING]
    if len(pair) > RIVALS or not pair or not others:
        return 0.0, first, first
    act, size = likeliest(weighing, SPRING, causes.least_n) or (None, 0.0)
    yields = size * weighing.springs[weighing.acts.index(act)] if act is not None else 0.0
    gain = 0.5 * (yields / SUPPORT_GIVES) ** 2
    out = min(causes.missing(name, at) for name in (pair if first == SPRING else [SPRING]))
    return float(min(gain, out)), first, others[0] if first == SPRING else SPRING


SPACING_M = 0.008
"""Between places that are weighed."""
TOUCH_ERROR_M = FirstTouch.next_touch.value
"""Of one first touch."""
PLACE_ERROR = Stiffness.next_touch.value
"""Of a press's modulus, relative: what shape and law do to a place, which neighbours share."""
LIGHT_M = 0.0025
"""Depth of a touch that only asks where the surface is."""


@dataclass(frozen=True)
class ReachOptions:
    """What the hand or the robot may do."""

    deepest_m: float = option(0.006, "greatest depth of a press", unit="m", flag="--deepest")
    deepest_share: float = option(
        0.18, "greatest depth of a press as a share of the material under the tip", low=0.01, high=0.9
    )
    strongest_n: float = option(
        5.0, "greatest force of a press, as far as it is known", unit="N", flag="--strongest", low=0.01
    )
    press_speed_m_per_s: float = option(0.02, "speed of a press", unit="m/s")
    air_speed_m_per_s: float = option(0.12, "speed through the air", unit="m/s")
    hold_s: float = option(0.2, "how long a press is held", unit="s")
    clearance_m: float = option(0.012, "height above the surface where a press begins", unit="m")
    between_s: float = option(0.5, "time before the next touch begins", unit="s")


@dataclass(frozen=True)
class TouchCandidate:
    """A touch that could be made: surface point (3,), outward unit normal (3,), depth m, seconds it takes,
    worth a second, and which goal gains most; how it is pressed, and which causes that would separate."""

    point: np.ndarray
    normal: np.ndarray
    depth_m: float
    seconds: float
    worth: float
    for_goal: str
    speed_m_per_s: float = 0.02
    hold_s: float = 0.2
    separation: Separation | None = None


def places(surface: Surface, tip_radius_m: float) -> np.ndarray:
    """Indices of vertices that the tip reaches: off the support by a tip's radius and a half, not hanging
    over, spread evenly."""
    up, origin = surface.support_normal, surface.support_point
    normals = vertex_normals(surface.vertices, surface.triangles)
    height = (surface.vertices - origin) @ up
    centre = height + tip_radius_m * (normals @ up)
    reachable = np.flatnonzero(
        (height > 1.5 * tip_radius_m) & (centre > tip_radius_m) & (normals @ up > -0.2)
    )
    if not len(reachable):
        reachable = np.flatnonzero(height > 0.5 * height.max())
    return reachable[farthest_points(surface.vertices[reachable], SPACING_M)]


@dataclass(frozen=True)
class Known:
    """What the worth of a touch depends on.

    touched: (k, 3) m, places pressed so far, depths_m: (k,); here: (3,) m, where the tip is. asked: (a, 3) m,
    places that were suggested: where one was not reached, no place nearby is suggested again. modulus_pa: nan
    where unknown; modulus_sd: of its logarithm, of which modulus_bias no touch takes away.
    """

    surface: Surface
    goals: tuple[GoalState, ...]
    touched: np.ndarray
    depths_m: np.ndarray
    here: np.ndarray
    asked: np.ndarray
    modulus_pa: float
    modulus_sd: float
    modulus_bias: float
    poisson_ratio: float
    tip_radius_m: float


def ranked(known: Known, reach: ReachOptions, separations: Sequence[Separation] = ()) -> list[TouchCandidate]:
    """All touches, the best first. separations: what each way of pressing would show of causes, at the places
    pressed so far."""
    surface = known.surface
    rows = _not_in_vain(surface.vertices, places(surface, known.tip_radius_m), known.touched, known.asked)
    normals = vertex_normals(surface.vertices, surface.triangles)
    free, area = off_support(surface)
    missing = {s.name: s for s in known.goals if s.missing > 0}
    own = surface_error(surface.uncertainty_m[free], area)
    made = []
    for row in rows:
        point, normal = surface.vertices[row], normals[row]
        gains = {"surface": 0.0}
        if "surface" in missing:
            after = after_touch(surface.vertices, surface.uncertainty_m, row)
            gains["surface"] = float(np.log(own / surface_error(after[free], area)))
        deepest = press_depth(known, point, reach)
        for way in _ways(deepest, bool({"modulus", "cause"} & missing.keys()), separations, reach):
            if "modulus" in missing:
                sd = modulus_after(known, point, way.depth_m)
                left = GoalState("", 1.96 * sd, missing["modulus"].goal)
                gains["modulus"] = missing["modulus"].missing - left.missing
            if "cause" in missing:
                gains["cause"] = UNKNOWN_GAIN if way.separation is None else way.separation.near(point)
            seconds = (
                float(np.linalg.norm(point - known.here)) / reach.air_speed_m_per_s
                + 2 * reach.clearance_m / reach.air_speed_m_per_s
                + 2 * way.depth_m / way.speed_m_per_s
                + way.hold_s
                + reach.between_s
            )
            best = max(gains, key=lambda g: gains[g])
            made.append(
                TouchCandidate(
                    point, normal, way.depth_m, seconds, sum(gains.values()) / seconds, best,
                    way.speed_m_per_s, way.hold_s, way.separation,
                )
            )  # fmt: skip
    return sorted(made, key=lambda c: -c.worth)


UNKNOWN_GAIN = 1e-3
"""Log evidence of a press whose worth for the cause is not known: any is better than none."""


@dataclass(frozen=True)
class _Way:
    depth_m: float
    speed_m_per_s: float
    hold_s: float
    separation: Separation | None = None


def _ways(deepest: float, deep: bool, separations: Sequence[Separation], reach: ReachOptions) -> list[_Way]:
    """How a place may be pressed: as usual, or by a plan that separates causes."""
    usual = _Way(deepest if deep else min(deepest, LIGHT_M), reach.press_speed_m_per_s, reach.hold_s)
    return [usual, *(_Way(min(p.depth_m, deepest), p.plan.speed, p.plan.hold, p) for p in separations)]


def _not_in_vain(
    vertices: np.ndarray, rows: np.ndarray, touched: np.ndarray, asked: np.ndarray
) -> np.ndarray:
    """Those of `rows` that do not lie where a suggestion was made and nothing near it was touched."""
    if not len(asked) or not len(touched):
        return rows
    away = np.linalg.norm(asked[:, None] - touched[None], axis=2).min(axis=1)
    vain = asked[away > SPACING_M]
    if not len(vain):
        return rows
    near = np.linalg.norm(vertices[rows][:, None] - vain[None], axis=2).min(axis=1) < SPACING_M
    return rows[~near] if not near.all() else rows


def after_touch(vertices: np.ndarray, deviation_m: np.ndarray, row: int) -> np.ndarray:
    """(n,) m: the surface's standard deviation once vertex `row` was touched."""
    variance = np.asarray(deviation_m, dtype=float) ** 2
    squared = ((vertices - vertices[row]) ** 2).sum(axis=1)
    shared = squared_exponential(2 * squared, CORRELATION_M)  # the square of exp(-r^2 / (2 L^2))
    resolved = variance[row] / (variance[row] + TOUCH_ERROR_M**2)
    return np.sqrt(variance * (1 - shared * resolved))


def modulus_after(known: Known, point: np.ndarray, depth_m: float) -> float:
    """Standard deviation of log E with one more press, `depth_m` deep at `point`."""
    sd, bias = known.modulus_sd, known.modulus_bias
    rest = max(sd**2 - bias**2, 0.0)
    after = _mean_variance(np.vstack([known.touched, point]), np.append(known.depths_m, depth_m))
    return float(np.sqrt(bias**2 + rest * after / _mean_variance(known.touched, known.depths_m)))


def _mean_variance(points: np.ndarray, depths_m: np.ndarray) -> float:
    """Of the best weighted mean of the log moduli of presses at points (k, 3), depths_m (k,) deep.

    F ~ d^1.5, so an error of first touch moves a press's modulus by 1.5 of its share of the depth.
    """
    squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    own = 1.5 * TOUCH_ERROR_M / np.maximum(depths_m, TOUCH_ERROR_M)
    covariance = PLACE_ERROR**2 * squared_exponential(squared, CORRELATION_M) + np.diag(own**2)
    return float(1 / np.linalg.solve(covariance, np.ones(len(points))).sum())


def press_depth(known: Known, point: np.ndarray, reach: ReachOptions) -> float:
    """m: as deep as is allowed there; the force is that of a half-space of the object's Poisson's ratio
    (Hertz)."""
    surface = known.surface
    thick = float((point - surface.support_point) @ surface.support_normal)
    span = float(np.ptp(surface.vertices, axis=0).min())
    depth = min(reach.deepest_m, reach.deepest_share * max(min(thick, span), 0.005))
    if np.isfinite(known.modulus_pa):
        hertz = dent_law("hertz").force(
            np.array([depth]), known.modulus_pa, known.poisson_ratio, known.tip_radius_m
        )
        depth *= min(1.0, (reach.strongest_n / float(hertz[0])) ** (2 / 3))
    return float(depth)


def first_places(
    boundary: Boundary, tip_radius_m: float, height_m: float | None
) -> list[tuple[np.ndarray, np.ndarray]]:
    """(point, outward normal) of touches before there is a surface: the top from above, then the sides.

    height_m: of the top where it was touched already, else None: from above until something is felt.
    """
    up = boundary.support_normal
    middle = boundary.outline.mean(axis=0)
    wide = float(np.linalg.norm(boundary.outline - middle, axis=1).mean())
    top = middle + (height_m if height_m is not None else wide) * up
    made = [(top, up)]
    if height_m is None:
        return made
    # three sides, half way up, and three places on the top between middle and rim
    for k in range(3):
        rim = boundary.outline[(k * len(boundary.outline)) // 3]
        outward = rim - middle
        outward = outward / np.linalg.norm(outward)
        made.append((rim + max(0.5 * height_m, 2 * tip_radius_m) * up, outward))
        made.append((middle + 0.55 * (rim - middle) + height_m * up, up))
    return made
