"""A nearly incompressible solid at finite strain: quadratic tetrahedra with mean dilatation.

Total Lagrangian. Isochoric energy W(I1bar) (neo-Hookean or Yeoh) split from the volumetric K U(theta), U =
((theta^2 - 1)/2 - ln theta)/2, with theta the element's mean volume ratio (Nagtegaal, Parks & Rice 1974;
Simo, Taylor & Pister 1985), which cures locking near a Poisson ratio of 0.5. Voigt order 11 22 33 12 23 13.
Lengths mm; stresses in units of the matrix's Young's modulus.
"""

from __future__ import annotations

import numba
import numpy as np

from palpate.scenes.laboratory.laws import PAIRS, circled, erf, isochoric, norm
from palpate.scenes.laboratory.mesh import GAUSS, QuadraticMesh, shape_gradients

_UNIT_GRADIENTS = np.array([shape_gradients(*b) for b in GAUSS])


class SolidMaterial:
    """Per Gauss point of a mesh (m elements, 4 points): what the solid is made of.

    shear, bulk: (m, 4), (m,) units of E. stiffening: c20 / c10 at small strains (laws.isochoric). fibre:
    (stiffness, direction) of a transversely isotropic term k/2 (I4bar - 1)^2, or stiffness 0. prony: g (share
    of the equilibrium stress) and tau (s) of each Maxwell branch. yields: (branch share g, yield stress) of
    an elastoplastic branch, or 0. mullins: (r, m) of Ogden & Roxburgh (1999) with m in energy units, r = 0
    without.
    """

    def __init__(self, cells: int, poisson_ratio: float) -> None:
        self.shear = np.full((cells, 4), 0.5 / (1 + poisson_ratio))
        self.bulk = np.full(cells, 1 / (3 * (1 - 2 * poisson_ratio)))
        self.stiffening = 0.0
        self.fibre = np.zeros(4)
        self.prony = np.zeros((0, 2))
        self.plastic = np.zeros(2)
        self.mullins = np.zeros(2)

    def scale(self, ratio: np.ndarray) -> None:
        """Multiply the modulus at each Gauss point by `ratio` (m, 4); the bulk follows the element's mean."""
        self.shear = self.shear * ratio
        self.bulk = self.bulk * ratio.mean(axis=1)


class History:
    """What the material remembers from the last converged state, per Gauss point (m, 4), and the elements'
    pressures (m,).
    """

    def __init__(self, cells: int, branches: int) -> None:
        self.stress = np.zeros((cells, 4, 6))
        self.overstress = np.zeros((cells, 4, branches, 6))
        self.plastic = np.zeros((cells, 4, 6))
        self.greatest = np.zeros((cells, 4))
        self.pressure = np.zeros(cells)

    def copy(self) -> History:
        """An independent copy."""
        twin = History(0, 0)
        for name in ("stress", "overstress", "plastic", "greatest", "pressure"):
            setattr(twin, name, getattr(self, name).copy())
        return twin


class Solid:
    """Residual, tangent and energy of a mesh with a material."""

    def __init__(self, mesh: QuadraticMesh, material: SolidMaterial) -> None:
        self.mesh, self.material = mesh, material
        jacobian = np.einsum("gax,eay->egxy", _UNIT_GRADIENTS, mesh.points[mesh.cells])
        self.weights = np.linalg.det(jacobian) / 24
        self.gradients = np.ascontiguousarray(
            np.einsum("egyx,gax->egay", np.linalg.inv(jacobian), _UNIT_GRADIENTS)
        )

    def gauss_points(self) -> np.ndarray:
        """(m, 4, 3) mm, where the Gauss points lie before any touch."""
        barycentric = np.column_stack([1 - GAUSS.sum(axis=1), GAUSS])
        edges = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)]
        corner = barycentric * (2 * barycentric - 1)
        middle = np.column_stack([4 * barycentric[:, i] * barycentric[:, j] for i, j in edges])
        return np.einsum("ga,eax->egx", np.hstack([corner, middle]), self.mesh.points[self.mesh.cells])

    def new_history(self) -> History:
        """A material that was never touched."""
        return History(len(self.mesh.cells), len(self.material.prony))

    def evaluate(
        self,
        displacement: np.ndarray,
        history: History,
        step_s: float,
        tangent: bool,
        pressure: np.ndarray | None = None,
    ) -> tuple[np.ndarray, np.ndarray, float, History]:
        """(element forces (m, 30), element stiffness (m, 30, 30) or empty, elastic energy, new history).

        displacement: (n, 3) mm. step_s: time since `history`, s (0 or less: infinitely slow, branches
        relaxed). pressure: (m,) what the stiffness is to believe of each element's pressure instead of what
        its volume says; the forces do not.
        """
        material, cells = self.material, self.mesh.cells
        new = History(len(cells), len(material.prony))
        forces = np.empty((len(cells), 30))
        stiffness = np.empty((len(cells) if tangent else 0, 30, 30))
        energy = _evaluate(
            cells, displacement, self.gradients, self.weights, material.shear, material.bulk,
            float(material.stiffening), material.fibre, material.prony, material.plastic, material.mullins,
            history.stress, history.overstress, history.plastic, history.greatest,
            new.stress, new.overstress, new.plastic, new.greatest, new.pressure,
            float(step_s), tangent, np.empty(0) if pressure is None else pressure, forces, stiffness,
        )  # fmt: skip
        return forces, stiffness, energy, new


@numba.njit(cache=True)
def _evaluate(
    cells, u, gradients, weights, shear, bulk, c20, fibre, prony, plastic, mullins,
    old_stress, old_over, old_plastic, old_greatest,
    new_stress, new_over, new_plastic, new_greatest, new_pressure,
    step, tangent, believed, forces, stiffness,
):  # fmt: skip
    total = 0.0
    branches = len(prony)
    decay, half = np.ones(max(branches, 1)), np.ones(max(branches, 1))
    gain = 1.0
    for k in range(branches):
        if step > 0.0:
            decay[k] = np.exp(-step / prony[k, 1])
            half[k] = (1 - decay[k]) * prony[k, 1] / step
        else:
            decay[k], half[k] = 0.0, 0.0
        gain += prony[k, 0] * half[k]
    stress, moduli = np.empty(6), np.empty((6, 6))
    big, bd = np.empty((6, 30)), np.empty((6, 30))
    local = np.empty((10, 3))
    f, c, trial = np.empty((3, 3)), np.empty(6), np.empty(6)
    b_store = np.empty((4, 6, 30))
    inv_store = np.empty((4, 6))
    for e in range(len(cells)):
        for a in range(10):
            for i in range(3):
                local[a, i] = u[cells[e, a], i]
        # first the geometry of all four points, for the element's mean dilatation
        volume, deformed = 0.0, 0.0
        for g in range(4):
            for i in range(3):
                for k in range(3):
                    value = 1.0 if i == k else 0.0
                    for a in range(10):
                        value += local[a, i] * gradients[e, g, a, k]
                    f[i, k] = value
            det = (
                f[0, 0] * (f[1, 1] * f[2, 2] - f[1, 2] * f[2, 1])
                - f[0, 1] * (f[1, 0] * f[2, 2] - f[1, 2] * f[2, 0])
                + f[0, 2] * (f[1, 0] * f[2, 1] - f[1, 1] * f[2, 0])
            )
            if det <= 0.02:
                return np.nan
            volume += weights[e, g]
            deformed += weights[e, g] * det
            for a in range(10):
                n0, n1, n2 = gradients[e, g, a, 0], gradients[e, g, a, 1], gradients[e, g, a, 2]
                for i in range(3):
                    column = 3 * a + i
                    b_store[g, 0, column] = f[i, 0] * n0
                    b_store[g, 1, column] = f[i, 1] * n1
                    b_store[g, 2, column] = f[i, 2] * n2
                    b_store[g, 3, column] = f[i, 0] * n1 + f[i, 1] * n0
                    b_store[g, 4, column] = f[i, 1] * n2 + f[i, 2] * n1
                    b_store[g, 5, column] = f[i, 0] * n2 + f[i, 2] * n0
            for p in range(6):
                i, k = PAIRS[p, 0], PAIRS[p, 1]
                inv_store[g, p] = f[0, i] * f[0, k] + f[1, i] * f[1, k] + f[2, i] * f[2, k]
        theta = deformed / volume
        pressure = bulk[e] * 0.5 * (theta - 1 / theta)
        total += volume * bulk[e] * 0.5 * (0.5 * (theta * theta - 1) - np.log(theta))
        for r in range(30):
            forces[e, r] = 0.0
        q = np.zeros(30)
        if tangent:
            for r in range(30):
                for s in range(30):
                    stiffness[e, r, s] = 0.0
        for g in range(4):
            w = weights[e, g]
            for p in range(6):
                c[p] = inv_store[g, p]
            energy, j, inverse = isochoric(c, shear[e, g], c20, fibre, stress, moduli)
            total += w * energy
            factor = gain
            soft, slope = 1.0, 0.0
            if mullins[0] > 0.0:
                greatest = max(old_greatest[e, g], energy)
                new_greatest[e, g] = greatest
                # damage counts from a tenth of the scale, so that rounding in a virgin solid does nothing
                scale = mullins[1] * greatest + 1e-9
                x = (greatest - energy) / scale
                soft = 1 - erf(x) / mullins[0]
                if energy < greatest:
                    slope = 2 / np.sqrt(np.pi) * np.exp(-x * x) / (mullins[0] * scale)
            if branches > 0 or plastic[0] > 0.0:
                for p in range(6):
                    new_stress[e, g, p] = stress[p]
            if tangent and slope > 0.0:
                for p in range(6):
                    for s in range(6):
                        moduli[p, s] = soft * moduli[p, s] + slope * stress[p] * stress[s]
            elif tangent and soft < 1.0:
                for p in range(6):
                    for s in range(6):
                        moduli[p, s] *= soft
            if soft < 1.0:
                for p in range(6):
                    stress[p] *= soft
            for p in range(6):
                trial[p] = 0.0
            for k in range(branches):
                for p in range(6):
                    value = decay[k] * old_over[e, g, k, p]
                    value += prony[k, 0] * half[k] * (new_stress[e, g, p] - old_stress[e, g, p])
                    new_over[e, g, k, p] = value
                    trial[p] += value
            if plastic[0] > 0.0:
                for p in range(6):
                    new_plastic[e, g, p] = old_plastic[e, g, p] + plastic[0] * (
                        new_stress[e, g, p] - old_stress[e, g, p]
                    )
                size = norm(new_plastic[e, g])
                limit = plastic[1] * shear[e, g]
                if size > limit:
                    for p in range(6):
                        new_plastic[e, g, p] *= limit / size
                    factor += plastic[0] * limit / size
                else:
                    factor += plastic[0]
                for p in range(6):
                    trial[p] += new_plastic[e, g, p]
            for p in range(6):
                stress[p] += trial[p] + pressure * j * inverse[p]
            new_pressure[e] = pressure
            for r in range(30):
                value, slope_volume = 0.0, 0.0
                for p in range(6):
                    value += b_store[g, p, r] * stress[p]
                    slope_volume += b_store[g, p, r] * inverse[p]
                forces[e, r] += w * value
                q[r] += w * j * slope_volume
            if tangent:
                if len(believed):
                    for p in range(6):
                        stress[p] += (believed[e] - pressure) * j * inverse[p]
                bulky = believed[e] if len(believed) else pressure
                for p in range(6):
                    for s in range(6):
                        moduli[p, s] = factor * moduli[p, s] + bulky * j * (
                            inverse[p] * inverse[s] - 2 * circled(inverse, p, s)
                        )
                big[:] = b_store[g]
                bd[:] = np.dot(moduli, big)
                stiffness[e] += w * np.dot(big.T, bd)
                for a in range(10):
                    n0, n1, n2 = gradients[e, g, a, 0], gradients[e, g, a, 1], gradients[e, g, a, 2]
                    s0 = stress[0] * n0 + stress[3] * n1 + stress[5] * n2
                    s1 = stress[3] * n0 + stress[1] * n1 + stress[4] * n2
                    s2 = stress[5] * n0 + stress[4] * n1 + stress[2] * n2
                    for b in range(10):
                        value = w * (
                            s0 * gradients[e, g, b, 0]
                            + s1 * gradients[e, g, b, 1]
                            + s2 * gradients[e, g, b, 2]
                        )
                        for i in range(3):
                            stiffness[e, 3 * a + i, 3 * b + i] += value
        if tangent:
            curvature = bulk[e] * 0.5 * (1 + 1 / (theta * theta)) / volume
            for r in range(30):
                for s in range(30):
                    stiffness[e, r, s] += curvature * q[r] * q[s]
    return total
