"""A rigid sphere against quadratic faces: unilateral penalty contact that sticks, or slips by Coulomb's
law.

Contact is checked at seven points of each face (degree-5 rule, Radon 1948). A point that meets the sphere
is anchored where it met it; a spring of stiffness `penalty` per area pulls it back to that place of the
sphere. With friction the anchor slides when the tangential traction exceeds mu times the pressure (return
mapping, Simo & Laursen 1992). Lengths mm, tractions in units of E, forces in E mm^2.
"""

from __future__ import annotations

import numba
import numpy as np

PENALTY = 60.0
"""Normal and tangential penalty stiffness, units of E per mm: 1/60 mm of overlap at a pressure of E."""

_A, _B = (6 - np.sqrt(15)) / 21, (6 + np.sqrt(15)) / 21
POINTS = np.array(
    [
        [1 / 3, 1 / 3],
        [_A, _A],
        [1 - 2 * _A, _A],
        [_A, 1 - 2 * _A],
        [_B, _B],
        [1 - 2 * _B, _B],
        [_B, 1 - 2 * _B],
    ]
)
WEIGHTS = np.array([0.1125, *[(155 - np.sqrt(15)) / 2400] * 3, *[(155 + np.sqrt(15)) / 2400] * 3])
"""Weights on the unit triangle (they sum to 1/2)."""


def _shapes(r: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    b = np.stack([1 - r - s, r, s], axis=1)
    slope = np.array([[-1.0, -1], [1, 0], [0, 1]])
    values = np.hstack(
        [b * (2 * b - 1), 4 * np.stack([b[:, 0] * b[:, 1], b[:, 1] * b[:, 2], b[:, 2] * b[:, 0]], 1)]
    )
    corner = (4 * b - 1)[:, :, None] * slope
    middle = [4 * (b[:, i, None] * slope[j] + b[:, j, None] * slope[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
    return values, np.concatenate([corner, np.stack(middle, axis=1)], axis=1)


SHAPES, SLOPES = _shapes(POINTS[:, 0], POINTS[:, 1])


class Anchors:
    """Contact state of every quadrature point at a converged load step: anchors relative to the sphere's
    centre.

    expected: points that a predicted step brings to the sphere; their anchors are where they would meet it.
    """

    def __init__(self, points: int) -> None:
        self.active = np.zeros(points, dtype=np.bool_)
        self.expected = np.zeros(points, dtype=np.bool_)
        self.anchor = np.zeros((points, 3))
        self.relative = np.full((points, 3), 1e6)

    def let_go(self, new: Anchors) -> bool:
        """Release the points held here that pull in `new`; they may still be pressed, but slide. Whether any
        were.
        """
        pulling = self.active & ~new.active
        self.active = self.active & ~pulling
        return bool(pulling.any())

    def settle(self, new: Anchors) -> None:
        """Points that were expected but do not press in `new` slide in this step, should they press later.

        Held they would pull and free they would press: Newton's method would go to and fro for ever.
        """
        self.expected = self.expected & new.active

    def copy(self) -> Anchors:
        """An independent copy."""
        twin = Anchors(0)
        for name in ("active", "expected", "anchor", "relative"):
            setattr(twin, name, getattr(self, name).copy())
        return twin


class SphereContact:
    """The faces (k, 6) that a sphere of `radius` mm may meet; friction None sticks, 0 slides freely."""

    def __init__(self, points: np.ndarray, faces: np.ndarray, radius: float, friction: float | None) -> None:
        self.points, self.faces, self.radius = points, faces, float(radius)
        self.friction = -1.0 if friction is None else float(friction)
        x = points[faces]
        tangents = np.einsum("qad,fax->fqdx", SLOPES, x)
        self.weights = np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) * WEIGHTS

    def start(self, centre: np.ndarray) -> Anchors:
        """Nothing touches yet; the sphere's centre is at `centre` mm."""
        grip = Anchors(self.weights.size)
        x = np.einsum("qa,fax->fqx", SHAPES, self.points[self.faces]).reshape(-1, 3)
        grip.relative = x - centre
        return grip

    def clear_of(self, centre: np.ndarray, grip: Anchors) -> np.ndarray:
        """The nearest centre that clears the untouched object, straight away from what is touched now."""
        out = -grip.anchor[grip.active].sum(axis=0)
        out /= np.linalg.norm(out)
        r = np.einsum("qa,fax->fqx", SHAPES, self.points[self.faces]).reshape(-1, 3) - centre
        along = r @ out
        inside = along**2 - (r**2).sum(axis=1) + self.radius**2
        way = along[inside > 0] + np.sqrt(inside[inside > 0])
        return centre + max(0.0, way.max(initial=0.0)) * out

    def expect(self, displacement: np.ndarray, centre: np.ndarray, held: Anchors) -> None:
        """Give the points that `displacement` brings into the sphere the places where they meet it.

        With these anchors a point sticks within the load step in which it arrives, as if the step were small.
        Only where the tip sticks: a sliding tip's arrivals find their places by sliding.
        """
        if self.friction < 0.0:
            x = np.einsum("qa,fax->fqx", SHAPES, (self.points + displacement)[self.faces]).reshape(-1, 3)
            _expect(x - centre, self.radius, held.active, held.expected, held.anchor, held.relative)

    def evaluate(
        self, displacement: np.ndarray, centre: np.ndarray, old: Anchors, tangent: bool, arrivals: bool = True
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, Anchors]:
        """(face forces (k, 18) resisting, face stiffness (k, 18, 18) or empty, force on the sphere (3,),
        new grip).

        arrivals: whether points that did not touch before may begin to; without them those that touch are
        carried along as if they stuck, which predicts a step.
        """
        count = len(self.faces)
        forces = np.zeros((count, 18))
        stiffness = np.zeros((count if tangent else 0, 18, 18))
        new = Anchors(self.weights.size)
        total = _evaluate(
            self.points, displacement, self.faces, self.weights, centre, self.radius, self.friction,
            old.active, old.expected, old.anchor, old.relative, new.active, new.anchor, new.relative,
            tangent, arrivals, forces, stiffness,
        )  # fmt: skip
        return forces, stiffness, total, new


@numba.njit(cache=True)
def _meeting(before, after, radius):
    """Where the segment of relative positions first meets the sphere; `after` lies inside."""
    d = after - before
    a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    b = before[0] * d[0] + before[1] * d[1] + before[2] * d[2]
    c = before[0] ** 2 + before[1] ** 2 + before[2] ** 2 - radius * radius
    share = 1.0
    if a > 1e-18 and c > 0.0 and b * b - a * c > 0.0:
        share = (-b - np.sqrt(b * b - a * c)) / a
    if share < 0.0 or share > 1.0:
        share = 1.0
    at = before + share * d
    return at * (radius / np.sqrt(at[0] ** 2 + at[1] ** 2 + at[2] ** 2))


@numba.njit(cache=True)
def _expect(relative, radius, active, expected, anchor, old_relative):
    for k in range(len(relative)):
        r = relative[k]
        expected[k] = not active[k] and r[0] ** 2 + r[1] ** 2 + r[2] ** 2 < radius * radius
        if expected[k]:
            anchor[k] = _meeting(old_relative[k], r, radius)


@numba.njit(cache=True)
def _evaluate(
    points, u, faces, weights, centre, radius, friction,
    old_active, expected, old_anchor, old_relative, active, anchor, relative,
    tangent, arrivals, forces, stiffness,
):  # fmt: skip
    total = np.zeros(3)
    block = np.empty((3, 3))
    for f in range(len(faces)):
        for q in range(7):
            k = 7 * f + q
            r = np.zeros(3)
            for a in range(6):
                node = faces[f, a]
                for i in range(3):
                    r[i] += SHAPES[q, a] * (points[node, i] + u[node, i])
            r -= centre
            relative[k] = r
            distance = np.sqrt(r[0] ** 2 + r[1] ** 2 + r[2] ** 2)
            fresh = not old_active[k]
            sticks = not fresh or expected[k]
            if fresh and (not arrivals or (distance >= radius and not sticks)):
                continue
            hold = old_anchor[k]
            if not sticks:
                # a point that nobody expected slides freely in the load step in which it arrives, and is
                # anchored for the next where it met the sphere: a trial anchor that follows the iterations
                # would spoil Newton's convergence
                hold = _meeting(old_relative[k], r, radius)
            m = hold / radius if friction < 0.0 and sticks else r / distance
            along = m[0] * r[0] + m[1] * r[1] + m[2] * r[2]
            overlap = radius - along
            # a held point may pull while Newton iterates: the solver lets go of it once the rest has settled
            carried = friction >= 0.0 and not fresh and not arrivals
            if overlap <= 0.0 and (fresh or (friction >= 0.0 and not carried)):
                continue
            active[k] = overlap > 0.0
            slip = r - hold
            out = m[0] * slip[0] + m[1] * slip[1] + m[2] * slip[2]
            slip -= out * m
            size = np.sqrt(slip[0] ** 2 + slip[1] ** 2 + slip[2] ** 2)
            grip = 1.0 if sticks else 0.0
            sliding = friction >= 0.0 and size > friction * overlap and not fresh and not carried
            if sliding:
                grip = friction * overlap / max(size, 1e-12)
            w = weights[f, q] * PENALTY
            # traction that the sphere puts on the object, with the sign of an internal resistance
            t = w * (-overlap * m + grip * slip)
            for a in range(6):
                for i in range(3):
                    forces[f, 3 * a + i] += SHAPES[q, a] * t[i]
            total += t
            if sliding:
                rest = r - grip * slip
                anchor[k] = rest * (radius / np.sqrt(rest[0] ** 2 + rest[1] ** 2 + rest[2] ** 2))
            else:
                anchor[k] = hold
            if tangent:
                for i in range(3):
                    for j in range(3):
                        unit = 1.0 if i == j else 0.0
                        side = unit - m[i] * m[j]
                        value = m[i] * m[j] + grip * side
                        if not sticks:
                            value -= overlap / distance * side
                        if sliding and size > 1e-12:
                            value -= grip * slip[i] * slip[j] / (size * size)
                            # sliding friction follows the pressure: this part is not symmetric
                            value -= friction * slip[i] * m[j] / size
                        block[i, j] = w * value
                for a in range(6):
                    for b in range(6):
                        share = SHAPES[q, a] * SHAPES[q, b]
                        for i in range(3):
                            for j in range(3):
                                stiffness[f, 3 * a + i, 3 * b + j] += share * block[i, j]
    return total
