"""The energy density below a contact, against what is known of a half-space."""

import numpy as np
import pytest

from palpate.mechanics.compliance.contact_energies import half_space_density


def test_the_density_adds_up_to_the_compliance_under_the_load():
    """A Gaussian pressure of unit force moves its own mean by 0.75 / (2 sqrt(pi) w) (nu = 0.5, E = 1)."""
    width = 2e-3
    z = np.geomspace(1e-2, 100, 400) * width
    r = np.concatenate([[0.0], np.geomspace(1e-2, 100, 400)]) * width
    rr, zz = np.meshgrid(r, z, indexing="ij")
    density = half_space_density(np.hypot(rr, zz), zz, width)
    total = np.trapezoid(np.trapezoid(density * 2 * np.pi * rr, r, axis=0), z)
    assert total == pytest.approx(0.75 / (2 * np.sqrt(np.pi) * width), rel=0.03)


def test_far_below_it_is_that_of_a_force_at_a_point():
    """Boussinesq at nu = 0.5: one radial stress 3 F z / (2 pi rho^3)."""
    place = np.array([[10e-3, 30e-3], [0.0, 40e-3], [25e-3, 25e-3]])
    distance = np.linalg.norm(place, axis=1)
    stress = 3 * place[:, 1] / (2 * np.pi * distance**3)
    assert half_space_density(distance, place[:, 1], 1e-3) == pytest.approx(stress**2, rel=0.03)
