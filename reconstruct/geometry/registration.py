"""Where a known shape lies in the device frame: its pose by the first touches (point to surface, robust).

At first touch the tip's centre is one tip radius off the surface, and the force says roughly which way the
surface faces. Pose p = (shift, turn) about a pivot is moved by Gauss-Newton steps on
    (signed distance of the centre - radius) / sigma,      (normal of the surface - direction of the force)
    / 15 deg
with Tukey's biweight, from many starts; each start's shift follows from its turn by the support function of
the shape, h(n) = max n . x, which a touch of normal n fixes: n . shift = n . centre - radius - h(n).
Source: point-to-plane registration after Chen and Medioni (1992); starts and weights are our own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.mechanics.shape.nearest import facings
from palpate.mechanics.shape.tetmesh import vertex_normals
from palpate.mechanics.statistics import EFFICIENT, spread_about_zero, tukey

DIRECTION_RAD = np.radians(15.0)
"""Standard deviation of a first force's direction about the normal."""
SURFACE_SD_M, SUPPORT_SD_M = 2e-4, 3e-4
"""Of a shape of 0.1 m: how true a file is, and how true a traced support; both grow with the object's
size."""
_STARTS, _SHORT, _LONG, _KEPT = 72, 8, 60, 6
_ALIKE_M = 0.02
"""Of the size: poses whose surfaces lie nearer than this are one."""


PAYS = 7.0
"""Nats by which touches must be likelier under a turn before it is made: odds of a thousand to one. A round
cap slides about its own middle and meets them in any pose."""
_ALL, _ABOUT_UP, _NO_TURN = np.arange(6), np.array([0, 1, 2, 5]), np.arange(3)
"""Numbers of a pose, shift then turn, that move: all; upright, about the device's z; none of the turn."""
_BEYOND = 3.0
"""First touches so many standard deviations of their own error and the surface's lie on another one."""


@dataclass(frozen=True)
class OffSurface:
    """How far first touches lie off a given surface, m: 68 % of the places are within `typical_m`, with what
    the pose's numbers have taken off; `most_m` is what the touches' own error and the surface's explain."""

    typical_m: float
    most_m: float

    @property
    def words(self) -> str:
        """The evidence, where it speaks against the surface; ''."""
        if self.typical_m <= self.most_m:
            return ""
        return (
            f"first touches lie {1e3 * self.typical_m:.1f} mm off it (68 % of the places), where "
            f"{1e3 * self.most_m:.1f} mm is the most that touches and surface explain"
        )


def off_surface(
    residual_m: np.ndarray, site: np.ndarray, error_m: np.ndarray, true_m: float, fitted: int
) -> OffSurface | None:
    """Of first touches (k,) m off a surface that is true to the object within true_m, of whose pose so many
    numbers were fitted to them; None of too few places."""
    places = np.unique(site)
    left = len(places) - fitted
    if left < 1:
        return None
    off = np.array([np.median(np.abs(residual_m[site == s])) for s in places])
    typical = float(np.percentile(off, 68.3)) * float(np.sqrt(len(places) / left))
    return OffSurface(typical, _BEYOND * float(np.hypot(np.median(error_m), true_m)))


@dataclass(frozen=True)
class TouchedPoints:
    """What the registration goes by; device frame. centres: (k, 3) m of the tip; normals: (k, 3) outward,
    from the force; error_m: (k,) standard deviation along it; site: (k,). support: (point (3,), normal
    (3,)) of a traced support, or None."""

    centres: np.ndarray
    normals: np.ndarray
    error_m: np.ndarray
    site: np.ndarray
    tip_radius_m: float
    support: tuple[np.ndarray, np.ndarray] | None = None

    def under(self, tip_radius_m: float) -> TouchedPoints:
        """The same by a tip of another radius, m: the support that it slid on lies that much nearer."""
        support = self.support
        if support is not None:
            support = support[0] + (self.tip_radius_m - tip_radius_m) * support[1], support[1]
        return replace(self, tip_radius_m=tip_radius_m, support=support)


@dataclass(frozen=True)
class ShapeToPlace:
    """A closed surface in its own frame, with its foot: point and normal into the object."""

    vertices: np.ndarray
    triangles: np.ndarray
    foot: np.ndarray
    up: np.ndarray


@dataclass(frozen=True)
class Registration:
    """device = rotation @ shape + shift_m.

    covariance: (6, 6) of a further (shift m, turn rad) about pivot (3,), device frame; a direction that the
    touches leave open has the prior's spread, half the object's size or half a radian. residual_m: (k,) of
    each first touch: how far the tip's centre was from one radius off the surface, positive outside. rms_m:
    robust, of those that count (weight (k,) 0 to 1). rival_m: rms of the best pose that is another one, inf
    where every start came to the same.
    """

    rotation: np.ndarray
    shift_m: np.ndarray
    pivot: np.ndarray
    covariance: np.ndarray
    residual_m: np.ndarray
    weight: np.ndarray
    rms_m: float
    rival_m: float = np.inf

    def to_device(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the shape's frame in the device frame."""
        return np.asarray(points) @ self.rotation.T + self.shift_m

    def modes(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """(n, 6) m: how the six independent errors of the pose, one standard deviation each, move a surface
        at points (n, 3) along its normals (n, 3)."""
        values, vectors = np.linalg.eigh(self.covariance)
        lever = np.hstack([normals, np.cross(points - self.pivot, normals)])
        return lever @ (vectors * np.sqrt(np.maximum(values, 0.0)))


def register(body: ShapeToPlace, touched: TouchedPoints, *, free: bool = True) -> Registration:
    """The most likely pose of a body by its touches.

    free: False takes the body where it stands and only tells the residuals: its pose has no error then.
    """
    solver = _Solver(body, touched)
    at = _Pose(np.eye(3), np.zeros(3))
    if not free:
        fit = solver.evaluate(at)
        return solver.result(at, fit, np.zeros((6, 6)))
    found = sorted((solver.descend(start, _SHORT) for start in solver.starts()), key=lambda each: each[0])
    best = sorted((solver.descend(pose, _LONG) for _, pose in found[:_KEPT]), key=lambda each: each[0])
    pose = solver.least_turned(best[0])
    fit = solver.evaluate(pose)
    others = [solver.evaluate(p) for _, p in best[1:] if solver.apart(pose, p)]
    rival = min((other.rms for other in others), default=np.inf)
    return solver.result(pose, fit, np.linalg.inv(fit.known), float(rival))


OTHER_RADII = (0.5, 2.0)
"""A tip's radius is stated as its diameter, or a diameter as the radius."""
_SIZES, _STEPS = np.linspace(-2.0, 2.0, 5), 8


def nats_for_radii(
    body: ShapeToPlace, touched: TouchedPoints, found: Registration, off_m: float
) -> dict[float, float]:
    """By how many nats first touches are likelier under each of OTHER_RADII times the stated radius.

    found: the pose by the stated one. off_m: standard deviation of the whole surface along its normals, m: a
    cast that shrank moves every touch as another tip does. Touches from one side tell neither, as the pose
    takes the difference up.
    """
    solver, stated = _Solver(body, touched), touched.tip_radius_m
    lost = {factor: np.inf for factor in (1.0, *OTHER_RADII)}
    for way in OTHER_RADII:
        pose = _Pose(found.rotation, found.shift_m)
        # in small steps, or the pose is left behind
        about = [
            stated + off_m * _SIZES,
            stated * np.linspace(1.0, way, _STEPS),
            way * stated + off_m * _SIZES,
        ]
        for radius in np.concatenate(about):
            solver.touched = touched.under(max(radius, 0.0))
            cost, pose = solver.descend(pose, 2 * _SHORT)
            for each in lost:
                gap = (radius - each * stated) / off_m
                lost[each] = min(lost[each], cost + gap**2 / 2)
    return {factor: lost[1.0] - lost[factor] for factor in OTHER_RADII}


@dataclass(frozen=True)
class _Pose:
    rotation: np.ndarray
    shift: np.ndarray


@dataclass(frozen=True)
class _Fit:
    """cost; normal (6, 6) and gradient (6,) of the weighted squares; known (6, 6): of distances alone,
    since a round body's normals do not turn with it; residual_m, weight (k,); rms m."""

    cost: float
    normal: np.ndarray
    known: np.ndarray
    gradient: np.ndarray
    residual_m: np.ndarray
    weight: np.ndarray
    rms: float


class _Solver:
    def __init__(self, body: ShapeToPlace, touched: TouchedPoints) -> None:
        import pyvista

        self.body, self.touched = body, touched
        self.shell = pyvista.PolyData.from_regular_faces(body.vertices, body.triangles)
        _, self.facing = facings(body.vertices, body.triangles)
        self.size = float(np.linalg.norm(np.ptp(body.vertices, axis=0)))
        self.pivot = touched.centres.mean(axis=0)
        scale = self.size / 0.1
        self.surface_sd, self.support_sd = SURFACE_SD_M * scale, SUPPORT_SD_M * scale
        self.sigma = np.hypot(touched.error_m, self.surface_sd)
        # repeats of one site tell one thing about the shape
        self.share = 1.0 / np.bincount(touched.site)[touched.site]
        self.prior = np.diag(np.repeat([(0.5 * self.size) ** -2, 0.5**-2], 3))
        normals = vertex_normals(body.vertices, body.triangles)
        rim = np.linalg.norm(normals, axis=1) > 0
        self.spots = body.vertices[rim]

    def starts(self) -> list[_Pose]:
        """Turns spread over all, the shift of each by the support function; upright ones where a support was
        traced."""
        if self.touched.support is None:
            turns = Rotation.random(_STARTS, rng=0).as_matrix()
            turns = np.concatenate([_upright(self.body.up, self.touched.normals.mean(axis=0), 24), turns])
        else:
            turns = _upright(self.body.up, self.touched.support[1], 36)
        return [_Pose(turn, self._shift(turn)) for turn in turns]

    def _shift(self, turn: np.ndarray) -> np.ndarray:
        n, weight = self.touched.normals, np.sqrt(self.share)[:, None]
        reach = (n @ turn @ self.spots.T).max(axis=1)
        known = np.einsum("ki,ki->k", n, self.touched.centres) - self.touched.tip_radius_m - reach
        # where normals leave the shift open, the touched spots' middle goes to the touches' middle
        spot = self.spots[(n @ turn @ self.spots.T).argmax(axis=1)] @ turn.T
        middle = (self.touched.centres - self.touched.tip_radius_m * n - spot).mean(axis=0)
        rows = np.vstack([n * weight, 0.05 * np.eye(3)])
        return np.linalg.lstsq(rows, np.concatenate([known * weight[:, 0], 0.05 * middle]), rcond=None)[0]

    def least_turned(self, best: tuple[float, _Pose]) -> _Pose:
        """The pose that the shape's file has, else an upright one, where it is no less likely than the best
        by more than chance; a traced support tells what is upright."""
        cost, pose = best
        if self.touched.support is not None:
            return pose
        as_filed = self.descend(_Pose(np.eye(3), self._shift(np.eye(3))), _LONG, _NO_TURN)
        turns = _upright(self.body.up, np.array([0.0, 0.0, 1.0]), 24)
        upright = [self.descend(_Pose(turn, self._shift(turn)), _SHORT, _ABOUT_UP) for turn in turns]
        upright = [self.descend(min(upright, key=lambda each: each[0])[1], _LONG, _ABOUT_UP)]
        return next((each for c, each in (as_filed, *upright) if c < cost + PAYS), pose)

    def descend(self, pose: _Pose, rounds: int, free: np.ndarray = _ALL) -> tuple[float, _Pose]:
        """Damped Gauss-Newton in the numbers `free` of the pose; the cost and pose at its end."""
        fit, damping = self.evaluate(pose), 1e-3
        for _ in range(rounds):
            normal, step = fit.normal[np.ix_(free, free)], np.zeros(6)
            step[free] = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), fit.gradient[free])
            trial = self.moved(pose, step)
            new = self.evaluate(trial)
            if new.cost > fit.cost:
                damping *= 8
                if damping > 1e6:
                    break
                continue
            gained, damping = fit.cost - new.cost, damping / 8
            pose, fit = trial, new
            if gained < 1e-7 * fit.cost:
                break
        return fit.cost, pose

    def moved(self, pose: _Pose, step: np.ndarray) -> _Pose:
        """The pose after a shift and a turn about the pivot."""
        turn = Rotation.from_rotvec(step[3:]).as_matrix()
        return _Pose(turn @ pose.rotation, turn @ (pose.shift - self.pivot) + self.pivot + step[:3])

    def evaluate(self, pose: _Pose) -> _Fit:
        """Cost and its derivatives by a further shift and turn."""
        touched = self.touched
        inside = (touched.centres - pose.shift) @ pose.rotation
        index, foot = self.shell.find_closest_cell(inside, return_closest_point=True)
        index, foot = np.atleast_1d(index), np.atleast_2d(foot)
        facing = self.facing[index]
        away = inside - foot
        length = np.linalg.norm(away, axis=1)
        side = np.where(np.einsum("ki,ki->k", away, facing) < 0, -1.0, 1.0)
        along = np.where(
            length[:, None] > 1e-9, side[:, None] * away / np.maximum(length, 1e-12)[:, None], facing
        )
        normal, spot = along @ pose.rotation.T, foot @ pose.rotation.T + pose.shift
        residual = side * length - touched.tip_radius_m
        lever = np.cross(spot - self.pivot, normal)
        scaled = residual / self.sigma
        spread = max(spread_about_zero(scaled), 1.0)
        reach = 2 * EFFICIENT * spread
        weight = np.maximum(tukey(np.clip(scaled / reach, -1, 1)), 1e-3) * self.share
        slopes = -np.hstack([normal, lever]) / self.sigma[:, None] / spread
        normal_matrix = (slopes * weight[:, None]).T @ slopes + self.prior
        gradient = slopes.T @ (weight * scaled / spread)
        # bounded, so that a slip is no proof
        lost = (reach**2 / 6) * (1 - np.clip(1 - (scaled / reach) ** 2, 0, None) ** 3)
        cost = float((self.share * (lost / spread**2 + np.log(spread))).sum())
        off = normal - touched.normals
        turn_weight = self.share / DIRECTION_RAD**2 / (1 + (off**2).sum(axis=1) / DIRECTION_RAD**2 / 9)
        known = normal_matrix.copy()
        cross = np.array([_cross(n) for n in normal])
        normal_matrix[3:, 3:] += np.einsum("k,kij,kil->jl", turn_weight, cross, cross)
        gradient[3:] += np.einsum("k,kij,ki->j", turn_weight, -cross, off)
        cost += float(4.5 * (self.share * np.log1p((off**2).sum(axis=1) / DIRECTION_RAD**2 / 9)).sum())
        if touched.support is not None:
            more, lost_support = self._support(pose, gradient)
            normal_matrix, known = normal_matrix + more, known + more
            cost += lost_support
        used = weight / self.share
        rms = float(np.sqrt(np.average(residual**2, weights=np.maximum(used, 1e-9))))
        return _Fit(cost, normal_matrix, known, gradient, residual, used, rms)

    def _support(self, pose: _Pose, gradient: np.ndarray) -> tuple[np.ndarray, float]:
        """The foot lies on the traced support, three places of it: normal matrix and cost; adds to the
        gradient."""
        assert self.touched.support is not None
        origin, up = self.touched.support
        first = np.eye(3)[np.argmin(np.abs(self.body.up))]
        u = np.cross(self.body.up, first)
        u /= np.linalg.norm(u)
        v = np.cross(self.body.up, u)
        spots = self.body.foot + 0.3 * self.size * np.array([u, v - 0.5 * u, -v - 0.5 * u])
        spots = spots @ pose.rotation.T + pose.shift
        miss = (spots - origin) @ up / self.support_sd
        slopes = np.hstack([np.tile(up, (3, 1)), np.cross(spots - self.pivot, up)]) / self.support_sd
        weight = 1 / (1 + (miss / 10) ** 2)
        gradient += slopes.T @ (weight * miss)
        return (slopes * weight[:, None]).T @ slopes, float(50 * np.log1p((miss / 10) ** 2).sum())

    def apart(self, one: _Pose, other: _Pose) -> bool:
        """Whether two poses put the surface at two places."""
        spots = self.spots[:: max(1, len(self.spots) // 300)]
        here = spots @ other.rotation.T + other.shift
        back = (here - one.shift) @ one.rotation
        _, foot = self.shell.find_closest_cell(back, return_closest_point=True)
        return bool(np.sqrt(np.mean((back - foot) ** 2) * 3) > _ALIKE_M * self.size)

    def result(self, pose: _Pose, fit: _Fit, covariance: np.ndarray, rival_m: float = np.inf) -> Registration:
        """Its pose, errors and residuals."""
        return Registration(
            rotation=pose.rotation,
            shift_m=pose.shift,
            pivot=self.pivot,
            covariance=covariance,
            residual_m=fit.residual_m,
            weight=fit.weight,
            rms_m=fit.rms,
            rival_m=rival_m,
        )


def _cross(n: np.ndarray) -> np.ndarray:
    """The matrix of n x."""
    return np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])


def _upright(up: np.ndarray, onto: np.ndarray, count: int) -> np.ndarray:
    """(count, 3, 3) turns that take `up` onto a direction, spread about it."""
    onto = onto / max(np.linalg.norm(onto), 1e-12)
    lean = Rotation.align_vectors(onto[None], up[None])[0]
    return np.array(
        [(Rotation.from_rotvec(a * onto) * lean).as_matrix() for a in 2 * np.pi * np.arange(count) / count]
    )
