"""Where the compliance of a place lies in the object, under a load as wide as a contact.

The energies of the elements (far_field.EnergyFields) are those of a load as wide as the mesh bears, and one
number an element. What a ball a few millimetres deep holds of them is neither: under a contact it is several
times as much, and it changes within an element. In a half-space both loads are known. Their strains differ
only near the place, so the object's strain is the half-space's under the contact, and what the elements
have beyond the half-space's under their load, taken as pointing the same way.

The strain of an incompressible half-space under an axisymmetric pressure is a Hankel transform (Sneddon,
Fourier Transforms, 1951): with p(k) = exp(-k^2 w^2 / 2) / 2 pi, A, B and C = int p k^2 exp(-k z) (J0, J1,
J1 / k r) dk, 2 G strain = z (rr: A - C, tt: C, zz: -A, rz: -B).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.legendre import leggauss
from scipy.special import j0, j1

from palpate.mechanics.compliance.far_field import EnergyFields, energy_fields, load_sampler
from palpate.mechanics.compliance.near_field import BALL_DEPTHS, contact_width
from palpate.mechanics.compliance.pressed_places import Places
from palpate.mechanics.shape.tetmesh import EDGES

if TYPE_CHECKING:
    from scipy.interpolate import RegularGridInterpolator

_CORNER = 0.5854
"""Weight of its own corner in each of the four points of a tetrahedron (second-order quadrature)."""
_NEAREST, _FARTHEST, _FLATTEST = 0.15, 40.0, 0.98
"""Of the table: in widths, in widths, in right angles from the axis."""
_FELT = 1e-4
_SPACING_M = 3.5e-3
"""Of the points, at the most: balls start at twice that."""
_EIGHT = np.array(
    [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3],
     [6, 8, 4, 5], [6, 8, 5, 9], [6, 8, 9, 7], [6, 8, 7, 4]]
)  # fmt: skip
"""Tetrahedra that one falls into, of its corners and the middles of its EDGES."""


@dataclass(frozen=True)
class ContactEnergies:
    """Energies at n points in the object, of q places.

    point: (n, 3) m, as many an element, in order. spacing: m, edge of a middle point's volume. normal: (2, q,
    n) 1/m, of unit normal loads on contacts of BALL_DEPTHS, unit modulus.
    """

    fields: EnergyFields
    point: np.ndarray
    spacing: float
    normal: np.ndarray

    def inside(self, centre: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """(indices, share) of the points in a ball: its edge is soft by their spacing, its volume its own."""
        away = self.point - centre
        soft = 0.35 * self.spacing
        beyond = (np.sqrt(np.einsum("ni,ni->n", away, away)) - radius) / soft
        felt = np.flatnonzero(beyond < -np.log(_FELT))
        share = 1 / (1 + np.exp(np.maximum(beyond[felt], -40.0)))
        return felt, share / (1 + (np.pi * soft / radius) ** 2)

    def held(self, centre: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """((q, 3, 3), (2, q)) 1/m that a ball's points hold, under the deeper contact, local frames, and of
        unit normal loads under both."""
        felt, share = self.inside(centre, radius)
        normal = self._pushed(felt, share)
        element, at = np.unique(felt // (len(self.point) // len(self.fields.centroid)), return_inverse=True)
        own = np.zeros((self.normal.shape[1], len(element)))
        np.add.at(own.T, at, (self.normal[1][:, felt] * share).T)
        energy = self.fields.energy[:, element]
        times = own / np.maximum(energy[:, :, 0, 0], 1e-30)
        return np.einsum("qm,qmij->qij", times, energy), normal.astype(float)

    def pushed(self, centre: np.ndarray, radius: float) -> np.ndarray:
        """(2, q) 1/m that a ball's points hold, of unit normal loads under both contacts."""
        return self._pushed(*self.inside(centre, radius))

    def _pushed(self, felt: np.ndarray, share: np.ndarray) -> np.ndarray:
        return self.normal[:, :, felt] @ share.astype(np.float32)


def contact_energies(places: Places) -> ContactEnergies:
    """Of all places; made once."""
    return places.stage("contact energies", lambda: _spread(places))


def _spread(places: Places) -> ContactEnergies:
    fields = energy_fields(places)
    mesh = fields.solver.mesh
    point, spacing = _points(mesh.points[mesh.tetrahedra[:, :4]], float(np.median(fields.volume)))
    tip, wide = places.model.tool.tip_radius_m, load_sampler(mesh).width_m
    q = len(places.first)
    normal = np.empty((len(BALL_DEPTHS), q, point.shape[0] * point.shape[1]), dtype=np.float32)
    for row, press in enumerate(places.first):
        away = point - places.point[press]
        deep = -away @ places.normal[press]
        distance = np.sqrt(np.einsum("msx,msx->ms", away, away))
        usual = half_space_density(distance, deep, wide)
        over = np.sqrt(
            fields.energy[row, :, 0, 0, None] / fields.volume[:, None] / usual.mean(axis=1, keepdims=True)
        )
        for each, depth in zip(normal, BALL_DEPTHS, strict=True):
            narrow = np.sqrt(half_space_density(distance, deep, contact_width(tip, depth)))
            strain = np.maximum(narrow + (over - 1) * np.sqrt(usual), 0.0)
            each[row] = (strain**2 * fields.volume[:, None] / point.shape[1]).ravel()
    return ContactEnergies(fields, point.reshape(-1, 3), spacing, normal)


def _points(corner: np.ndarray, volume: float) -> tuple[np.ndarray, float]:
    """((m, s, 3), spacing) m: equal volumes' points of tetrahedra of corners (m, 4, 3) and a median volume
    m^3."""
    inner = corner[:, None]
    while np.cbrt(volume / 4) > _SPACING_M:
        middle = inner[:, :, EDGES].mean(axis=3)
        inner = np.concatenate([inner, middle], axis=2)[:, :, _EIGHT].reshape(len(corner), -1, 4, 3)
        volume /= 8
    weight = np.full((4, 4), (1 - _CORNER) / 3) + np.eye(4) * (_CORNER - (1 - _CORNER) / 3)
    return np.einsum("sk,mtkx->mtsx", weight, inner).reshape(len(corner), -1, 3), float(np.cbrt(volume / 4))


def half_space_density(distance: np.ndarray, deep: np.ndarray, width: float) -> np.ndarray:
    """Energy density 1/m^4 of a half-space, unit force and modulus, at a distance m from the middle of a
    Gaussian pressure and so deep m; beyond the table as of a force at a point."""
    far = np.clip(distance / width, _NEAREST, None)
    angle = np.arccos(np.clip(deep / np.maximum(distance, 1e-12), np.cos(0.5 * np.pi * _FLATTEST), 1.0))
    known = np.minimum(far, _FARTHEST)
    return np.exp(_table()(np.stack([np.log(known), angle], axis=-1))) * (known / far) ** 4 / width**4


@cache
def _table() -> RegularGridInterpolator:
    """Logarithm of the density, by that of the distance in widths and the angle from the axis."""
    from scipy.interpolate import RegularGridInterpolator  # here: a touch needs no energies

    far = np.geomspace(_NEAREST, _FARTHEST, 70)
    angle = np.linspace(0.0, 0.5 * np.pi * _FLATTEST, 25)
    r, z = (far[:, None] * f(angle) for f in (np.sin, np.cos))
    node, weight = leggauss(120)
    k, weight = 4 * (node + 1), 4 * weight
    kr = r[..., None] * k
    each = weight * np.exp(-0.5 * k * k - z[..., None] * k) / (2 * np.pi) * k**2
    over = np.where(kr > 1e-6, j1(kr) / np.maximum(kr, 1e-9), 0.5)
    a, b, c = ((each * f).sum(axis=-1) for f in (j0(kr), j1(kr), over))
    density = 1.5 * z**2 * ((a - c) ** 2 + c**2 + a**2 + 2 * b**2)
    return RegularGridInterpolator((np.log(far), angle), np.log(density))
