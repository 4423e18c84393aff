"""A nearly incompressible solid at finite strain: quadratic tetrahedra with mean dilatation.

Total Lagrangian, in F = 1 + du/dX and the first Piola-Kirchhoff stress. Theta is an element's mean volume
ratio (Nagtegaal, Parks & Rice 1974; Simo, Taylor & Pister 1985), h the family of
mechanics.effects.strain_stiffening. Two energies, alike where nothing changes its volume:

    split      W(I1bar) + K (theta^2 / 4 - ln(theta) / 2), 2 dW/dI1bar = mu h(I1bar - 3)
    coupled    W(I1) - mu ln J + lambda ln(theta)^2 / 2, 2 dW/dI1 = mu h(I1 - 3), as the dent's tables

The tangent of both at rest is the small-strain solid. Lengths m, stresses in units of the global Young's
modulus.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.elastic.elasticity import lame_parameters, shape_derivatives
from palpate.mechanics.kernels import kernel
from palpate.mechanics.press_solver.graded_mesh import GAUSS

_LOCAL_SHARE = 0.1


@dataclass
class Response:
    """What elements answer to a displacement. forces (m, 30); stiffness (m, 30, 30), or empty; energy.

    pressure, slope (m,): K U' and K U'' / volume; growth (m, 30): derivative of an element's volume.
    """

    forces: np.ndarray
    stiffness: np.ndarray
    energy: float
    pressure: np.ndarray
    slope: np.ndarray
    growth: np.ndarray


class SolidElements:
    """Elements of a body: points (n, 3) m, cells (m, 10), their modulus over the global one (m,), or None.

    stiffening: r of the family, 0 neo-Hookean. coupled: which of the two energies. local_bulk: bulk modulus
    over the shear modulus that is held point by point instead of by an element's mean, a tenth at most.
    """

    def __init__(
        self,
        points: np.ndarray,
        cells: np.ndarray,
        poisson_ratio: float,
        stiffening: float = 0.0,
        ratio: np.ndarray | None = None,
        coupled: bool = False,
        local_bulk: float = 0.0,
    ) -> None:
        self.cells = np.ascontiguousarray(cells)
        self.stiffening, self.coupled = float(stiffening), coupled
        slopes = np.array([shape_derivatives(2, at) for at in GAUSS])
        slopes = slopes[..., 1:] - slopes[..., :1]
        jacobian = np.einsum("qax,eay->eqxy", slopes, points[cells])
        self.weights = np.ascontiguousarray(np.linalg.det(jacobian) / 24)
        self.gradients = np.ascontiguousarray(np.einsum("eqyx,qax->eqay", np.linalg.inv(jacobian), slopes))
        lam, mu = lame_parameters(1.0, poisson_ratio)
        ratio = np.ones(len(cells)) if ratio is None else np.asarray(ratio, dtype=float)
        bulk = lam if coupled else lam + 2 * mu / 3
        local = min(_LOCAL_SHARE * bulk, local_bulk * mu)
        self.shear, self.bulk, self.local_bulk = mu * ratio, (bulk - local) * ratio, local * ratio

    def __len__(self) -> int:
        return len(self.cells)

    def respond(
        self, displacement: np.ndarray, *, tangent: bool = False, pressure: np.ndarray | None = None
    ) -> Response | None:
        """The answer to a displacement (n, 3) m of all nodes, or None where an element is turned inside out.

        pressure: (m,) for the tangent to take in the place of K U'(theta): what Newton's method for pressure
        and displacement together predicts. At a predicted displacement volumes are off to second order, and
        the bulk modulus makes pressures of that which would spoil the tangent.
        """
        m = len(self.cells)
        forces, growth = np.empty((m, 30)), np.empty((m, 30))
        stiffness = np.empty((m if tangent else 0, 30, 30))
        own, slope = np.empty(m), np.empty(m)
        given = np.empty(0) if pressure is None else pressure
        energy = _respond(
            self.cells, displacement, self.gradients, self.weights, self.shear, self.bulk, self.local_bulk,
            self.stiffening, self.coupled, given, tangent,
            np.empty((4, 3, 3)), np.empty((6, 3)), np.empty((3, 3, 3, 3)), np.empty((3, 3, 3)),
            forces, stiffness, own, slope, growth,
        )  # fmt: skip
        if not np.isfinite(energy):
            return None
        return Response(forces, stiffness, energy, own, slope, growth)


@kernel
def _respond(
    cells, u, gradients, weights, shear, bulk, local_bulk, ratio, coupled, given, tangent, f, h, moduli, half,
    forces, stiffness, pressure, slope, growth,
):  # fmt: skip
    """Energy; nan where an element is turned inside out. f, h, moduli, half: room to work in."""
    total = 0.0
    for e in range(cells.shape[0]):
        volume, deformed = 0.0, 0.0
        for q in range(4):
            for i in range(3):
                for j in range(3):
                    f[q, i, j] = 1.0 if i == j else 0.0
            for a in range(10):
                node = cells[e, a]
                for i in range(3):
                    for j in range(3):
                        f[q, i, j] += u[node, i] * gradients[e, q, a, j]
            det = _determinant(f[q])
            if not det > 0.02:
                return np.nan
            volume += weights[e, q]
            deformed += weights[e, q] * det
        stored, per_bulk, per_theta = _volume_energy(deformed / volume, coupled)
        total += volume * bulk[e] * stored
        pressure[e], slope[e] = bulk[e] * per_bulk, bulk[e] * per_theta / volume
        believed = given[e] if given.shape[0] else pressure[e]
        for r in range(30):
            forces[e, r] = 0.0
            growth[e, r] = 0.0
            if tangent:
                for s in range(30):
                    stiffness[e, r, s] = 0.0
        for q in range(4):
            g, w = gradients[e, q], weights[e, q]
            det = _determinant(f[q])
            _cofactor(f[q], det, h)  # h[0:3] holds F^-T
            first = 0.0
            for i in range(3):
                for j in range(3):
                    first += f[q, i, j] * f[q, i, j]
            scale = 1.0 if coupled else det ** (-2.0 / 3.0)
            excess = scale * first - 3.0
            if ratio > 0.0:
                hard = np.exp(2 * ratio * excess)
                harder = 2 * ratio * hard
                energy = (hard - 1) / (2 * ratio)
            elif ratio < 0.0:
                inside = 1 - 4 * ratio * excess
                hard = 1 / np.sqrt(inside)
                harder = 2 * ratio * hard / inside
                energy = (1 - np.sqrt(inside)) / (2 * ratio)
            else:
                hard, harder, energy = 1.0, 0.0, excess
            mu = shear[e]
            stored, per_bulk, per_theta = _volume_energy(det, coupled)
            local, stiffer = local_bulk[e] * per_bulk, local_bulk[e] * per_theta * det * det
            total += w * (0.5 * mu * energy + local_bulk[e] * stored)
            # half the derivative of I1 or I1bar, kept in h[3:6]
            for i in range(3):
                for j in range(3):
                    h[3 + i, j] = scale * (f[q, i, j] - (0.0 if coupled else first / 3 * h[i, j]))
            around = local  # pressure of this point alone
            if coupled:
                total -= w * mu * np.log(det)
                around -= mu / det
            for a in range(10):
                for i in range(3):
                    push, grow = 0.0, 0.0
                    for j in range(3):
                        push += h[3 + i, j] * g[a, j]
                        grow += h[i, j] * g[a, j]
                    forces[e, 3 * a + i] += w * (mu * hard * push + around * det * grow)
                    growth[e, 3 * a + i] += w * det * grow
            if tangent:
                p = (believed + local) * det
                c = mu * hard * scale
                for i in range(3):
                    for j in range(3):
                        for k in range(3):
                            for l in range(3):
                                value = p * (h[i, j] * h[k, l] - h[i, l] * h[k, j])
                                value += stiffer * h[i, j] * h[k, l]
                                if coupled:
                                    value += mu * h[i, l] * h[k, j]
                                else:
                                    value += c * first * (h[i, l] * h[k, j] / 3 + h[i, j] * h[k, l] * 2 / 9)
                                    value -= c * 2 / 3 * (h[i, j] * f[q, k, l] + f[q, i, j] * h[k, l])
                                value += 2 * mu * harder * h[3 + i, j] * h[3 + k, l]
                                if i == k and j == l:
                                    value += c
                                moduli[i, j, k, l] = w * value
                for a in range(10):
                    for i in range(3):
                        for k in range(3):
                            for l in range(3):
                                half[i, k, l] = (
                                    g[a, 0] * moduli[i, 0, k, l]
                                    + g[a, 1] * moduli[i, 1, k, l]
                                    + g[a, 2] * moduli[i, 2, k, l]
                                )
                    for b in range(a, 10):
                        for i in range(3):
                            for k in range(3):
                                for l in range(3):
                                    stiffness[e, 3 * a + i, 3 * b + k] += half[i, k, l] * g[b, l]
        for r in range(30):
            forces[e, r] += pressure[e] * growth[e, r]
        if tangent:
            for r in range(30):
                for s in range(30):
                    if s // 3 >= r // 3:
                        stiffness[e, r, s] += slope[e] * growth[e, r] * growth[e, s]
            for r in range(30):
                for s in range(r):
                    stiffness[e, r, s] = stiffness[e, s, r]
    return total


@kernel
def _volume_energy(theta, coupled):
    """(U, U', U'') of a volume ratio, for unit bulk modulus."""
    log = np.log(theta)
    if coupled:
        return 0.5 * log * log, log / theta, (1 - log) / (theta * theta)
    square = theta * theta
    return 0.5 * (0.5 * (square - 1) - log), 0.5 * (theta - 1 / theta), 0.5 * (1 + 1 / square)


@kernel
def _determinant(f):
    return (
        f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
        - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
        + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
    )


@kernel
def _cofactor(f, det, h):
    """F^-T to the first three rows of h."""
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            h[i, j] = (f[i1, j1] * f[i2, j2] - f[i1, j2] * f[i2, j1]) / det
