"""A rigid sphere against curved quadratic faces: it sticks, slips by Coulomb's law, or slides freely.

Contact is asked at the points of a composite rule on every face: nine parts, three points each. A point that
presses is anchored where it met the sphere. A sticking point is drawn to its anchor by a spring of `penalty`
an area; with friction the tangential part of its pull is at most a bound, and the anchor follows (return
mapping: Simo & Laursen 1992). The bound is mu times the pressure and follows it within Newton's method, whose
tangent is not symmetric then. Lengths m, tractions in units of Young's modulus.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.kernels import kernel

_PARTS = 3


def _rule(parts: int) -> tuple[np.ndarray, float]:
    """Barycentric points (q, 3) of a triangle cut into parts^2, three points in each; their equal weight on
    the unit triangle. Exact for quadratics."""
    corners = []
    for i in range(parts):
        for j in range(parts - i):
            corners.append([(i, j), (i + 1, j), (i, j + 1)])
            if i + j < parts - 1:
                corners.append([(i + 1, j), (i + 1, j + 1), (i, j + 1)])
    triangles = np.array(corners) / parts
    mix = np.full((3, 3), 1 / 6) + np.eye(3) / 2
    rs = np.einsum("pc,tcx->tpx", mix, triangles).reshape(-1, 2)
    return np.column_stack([1 - rs.sum(axis=1), rs]), 0.5 / len(rs)


def _shapes(b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shape functions (q, 6) of a quadratic triangle and their derivatives (q, 6, 2)."""
    pairs = ((0, 1), (1, 2), (2, 0))
    values = np.hstack([b * (2 * b - 1), np.column_stack([4 * b[:, i] * b[:, j] for i, j in pairs])])
    slope = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    corner = (4 * b - 1)[:, :, None] * slope
    middle = [4 * (b[:, i, None] * slope[j] + b[:, j, None] * slope[i]) for i, j in pairs]
    return values, np.concatenate([corner, np.stack(middle, axis=1)], axis=1)


_POINTS, _WEIGHT = _rule(_PARTS)
SHAPES, SLOPES = (np.ascontiguousarray(each) for each in _shapes(_POINTS))


@dataclass
class ContactMemory:
    """What the contact remembers of every point at a converged step, relative to the sphere's centre.

    anchored (p,) bool; anchor (p, 3) m on the sphere; relative (p, 3) m, where the points are.
    """

    anchored: np.ndarray
    anchor: np.ndarray
    relative: np.ndarray

    def copy(self) -> ContactMemory:
        """An independent copy."""
        return ContactMemory(self.anchored.copy(), self.anchor.copy(), self.relative.copy())


@dataclass
class Traction:
    """The contact's answer. forces (d,): resistance on the faces' unknowns; stiffness (d, d); force (3,): on
    the sphere; overlap (p,) m: positive where a point presses; slid (p, 3) m: the anchors as they are then.
    """

    forces: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray
    overlap: np.ndarray
    slid: np.ndarray


class PressContact:
    """The faces (k, 6), in numbers of `points` (n, 3) m, that a sphere of `radius` m may meet.

    friction: Coulomb's coefficient, None sticks. penalty: traction an overlap, 1/m (of Young's modulus).
    """

    def __init__(
        self, points: np.ndarray, faces: np.ndarray, radius: float, friction: float | None, penalty: float
    ) -> None:
        self.points, self.faces = points, np.ascontiguousarray(faces)
        self.radius, self.penalty = float(radius), float(penalty)
        self.friction = -1.0 if friction is None else float(friction)
        self.weights = self.areas(points)

    def areas(self, points: np.ndarray) -> np.ndarray:
        """(k, q) m^2 of each point of each face where the nodes are at `points`."""
        return np.linalg.norm(self.area_vectors(points), axis=2)

    def area_vectors(self, points: np.ndarray) -> np.ndarray:
        """(k, q, 3) m^2, outward."""
        along = np.einsum("qad,fax->fqdx", SLOPES, points[self.faces])
        return np.cross(along[:, :, 0], along[:, :, 1]) * _WEIGHT

    def places(self, displacement: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """(c q, 3) m, where the points of the faces `chosen` (c,) are."""
        x = (self.points + displacement)[self.faces[chosen]]
        return np.einsum("qa,fax->fqx", SHAPES, x).reshape(-1, 3)

    def of_faces(self, chosen: np.ndarray) -> np.ndarray:
        """Numbers (c q,) of the points of the faces `chosen` (c,)."""
        return (len(SHAPES) * chosen[:, None] + np.arange(len(SHAPES))).ravel()

    def start(self, centre: np.ndarray) -> ContactMemory:
        """Nothing touches; the sphere's centre is at `centre` m."""
        x = self.places(np.zeros_like(self.points), np.arange(len(self.faces))) - centre
        return ContactMemory(np.zeros(len(x), dtype=bool), np.zeros_like(x), x)

    def evaluate(
        self,
        relative: np.ndarray,
        chosen: np.ndarray,
        unknowns: np.ndarray,
        size: int,
        grip: ContactMemory,
        sticks: bool = False,
    ) -> Traction:
        """The contact of the faces `chosen` (c,) whose points are at `relative` (c q, 3) to the centre.

        unknowns: (c, 18), the numbers below `size` of the faces' degrees of freedom. sticks: whatever the
        friction, which carries the points along with a sphere that has moved.
        """
        own, friction = self.of_faces(chosen), -1.0 if sticks else self.friction
        forces, stiffness, force = np.zeros(size), np.zeros((size, size)), np.zeros(3)
        overlap, slid = np.zeros(len(own)), np.zeros((len(own), 3))
        _evaluate(
            relative, self.weights[chosen].ravel(), unknowns, self.radius, friction, self.penalty,
            grip.anchored[own], grip.anchor[own], SHAPES,
            np.empty((3, 3)), np.empty(3), np.empty(3),
            forces, stiffness, force, overlap, slid,
        )  # fmt: skip
        return Traction(forces, stiffness, force, overlap, slid)

    def met(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """(k, 3) m: where points that go straight from `before` to `after` (k, 3) first meet the sphere."""
        way = after - before
        a = np.maximum(np.einsum("ki,ki->k", way, way), 1e-300)
        b = np.einsum("ki,ki->k", before, way)
        c = np.einsum("ki,ki->k", before, before) - self.radius**2
        root = np.sqrt(np.maximum(b * b - a * c, 0.0))
        share = np.where((c > 0) & (b * b > a * c), np.clip((-b - root) / a, 0.0, 1.0), 1.0)
        at = before + share[:, None] * way
        return at * (self.radius / np.linalg.norm(at, axis=1, keepdims=True))


@kernel
def _evaluate(
    relative, weights, unknowns, radius, friction, penalty, anchored, anchor, shapes, block, t, s,
    forces, stiffness, force, overlap, slid,
):  # fmt: skip
    count = shapes.shape[0]
    for f in range(unknowns.shape[0]):
        for q in range(count):
            k = count * f + q
            x, y, z = relative[k, 0], relative[k, 1], relative[k, 2]
            far = np.sqrt(x * x + y * y + z * z)
            w = penalty * weights[k]
            sticks = anchored[k] and friction < 0.0
            # the way out of the sphere that the pressure is along
            if sticks:
                mx, my, mz = anchor[k, 0] / radius, anchor[k, 1] / radius, anchor[k, 2] / radius
            else:
                mx, my, mz = x / far, y / far, z / far
            deep = radius - (mx * x + my * y + mz * z)
            overlap[k] = deep
            # a sticking point may pull: who settles the contact lets go of it once the rest is at peace
            if not deep > 0.0 and not sticks:
                continue
            for i in range(3):
                slid[k, i] = anchor[k, i]
                m_i = mx if i == 0 else (my if i == 1 else mz)
                for j in range(3):
                    m_j = mx if j == 0 else (my if j == 1 else mz)
                    side = (1.0 if i == j else 0.0) - m_i * m_j
                    block[i, j] = m_i * m_j if sticks else m_i * m_j - deep / far * side
                    if sticks:
                        block[i, j] += side
            if sticks:
                t[0], t[1], t[2] = x - anchor[k, 0], y - anchor[k, 1], z - anchor[k, 2]
            else:
                t[0], t[1], t[2] = -deep * mx, -deep * my, -deep * mz
            if anchored[k] and friction > 0.0:
                along = anchor[k, 0] * mx + anchor[k, 1] * my + anchor[k, 2] * mz
                s[0], s[1] = along * mx - anchor[k, 0], along * my - anchor[k, 1]
                s[2] = along * mz - anchor[k, 2]
                size = np.sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2])
                most = friction * deep
                slips = size > most and size > 0.0
                grip = most / size if slips else 1.0
                for i in range(3):
                    m_i = mx if i == 0 else (my if i == 1 else mz)
                    for j in range(3):
                        m_j = mx if j == 0 else (my if j == 1 else mz)
                        side = (1.0 if i == j else 0.0) - m_i * m_j
                        # how the slip s = (m.a) m - a turns with the point
                        ds = (along * side - m_i * s[j]) / far
                        if slips:
                            across = along / far * (side - s[i] * s[j] / (size * size))
                            block[i, j] += grip * (across - m_i * s[j] / far)
                            block[i, j] -= friction * s[i] / size * m_j
                        else:
                            block[i, j] += ds
                if slips:
                    rest_x, rest_y, rest_z = x - grip * s[0], y - grip * s[1], z - grip * s[2]
                    out = radius / np.sqrt(rest_x * rest_x + rest_y * rest_y + rest_z * rest_z)
                    slid[k, 0], slid[k, 1], slid[k, 2] = rest_x * out, rest_y * out, rest_z * out
                for i in range(3):
                    t[i] += grip * s[i]
            for i in range(3):
                t[i] *= w
                force[i] += t[i]
            for a in range(6):
                share = shapes[q, a]
                for i in range(3):
                    row = unknowns[f, 3 * a + i]
                    if row < 0:
                        continue
                    forces[row] += share * t[i]
                    for b in range(6):
                        both = share * shapes[q, b] * w
                        for j in range(3):
                            column = unknowns[f, 3 * b + j]
                            if column >= 0:
                                stiffness[row, column] += both * block[i, j]
