"""Fits to machines' curves that only benchmarks need: an elastomer in compression, the memory of holds."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, minimize_scalar
from scipy.special import expit

from palpate.mechanics.effects.power_law_relaxation import prony_terms
from palpate.mechanics.effects.strain_stiffening import GREATEST, LEAST, hardening
from palpate.mechanics.errors import RecordingError
from palpate.reconstruction.machine_curves.uniaxial import Compression


@dataclass(frozen=True)
class Elastomer:
    """An incompressible material: Young's modulus, Pa, and c20 / c10 of effects.strain_stiffening."""

    young_modulus_pa: float
    c20_over_c10: float

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Pa, force over the first area, positive in compression, at engineering strains (n,) below 1."""
        return self.young_modulus_pa * _unit_stress(strain, self.c20_over_c10)


def _unit_stress(strain: np.ndarray, ratio: float) -> np.ndarray:
    stretch = 1 - np.asarray(strain, dtype=float)
    h, _ = hardening(stretch**2 + 2 / stretch - 3, ratio)
    return h * (stretch**-2 - stretch) / 3


def fit_elastomer(
    tests: Sequence[Compression],
    *,
    to_strain: float = 0.4,
    from_strain: float = 0.02,
    ratio: float | None = None,
) -> Elastomer:
    """The material whose stress errs least, in shares of each test's greatest, between two strains.

    ratio: c20 / c10, where it is known. The faces are taken to slide on the platens. Raises RecordingError
    where no sample lies there.
    """
    parts = [(t, (t.strain >= from_strain) & (t.strain <= to_strain)) for t in tests]
    if not parts or min(use.sum() for _, use in parts) < 3:
        raise RecordingError(f"fewer than 3 samples lie between the strains {from_strain} and {to_strain}")
    strain = np.concatenate([t.strain[use] for t, use in parts])
    stress = np.concatenate([t.stress[use] for t, use in parts])
    weight = np.concatenate([np.full(use.sum(), 1 / t.stress[use].max()) for t, use in parts])

    def modulus(ratio: float) -> tuple[float, float]:
        unit = weight * _unit_stress(strain, ratio)
        e = float(unit @ (weight * stress) / (unit @ unit))
        return e, float(((e * unit - weight * stress) ** 2).sum())

    if ratio is not None:
        return Elastomer(modulus(ratio)[0], ratio)
    best = minimize_scalar(lambda r: modulus(r)[1], bounds=(LEAST, GREATEST), method="bounded")
    return Elastomer(modulus(best.x)[0], float(best.x))


@dataclass(frozen=True)
class Held:
    """One press, a ramp and a hold: force (n,) N at t (n,) s from before first touch; the tip stands still
    from sample `held` on."""

    t: np.ndarray
    force: np.ndarray
    held: int


def from_own_ramp(press: Held, g: np.ndarray, tau_s: np.ndarray) -> np.ndarray:
    """(n,) N that a press reads with the memory g, tau_s (k,) whose elastic force is what its own ramp tells.

    The memory is taken off the ramp, which is then read as it was; from the hold on the elastic force stays.
    No law of the dent enters, so a piece's own shape and stiffness do not.
    """
    g, tau = np.asarray(g, dtype=float), np.asarray(tau_s, dtype=float)
    steps = np.diff(press.t)
    branch, elastic, out = np.zeros(len(g)), 0.0, np.zeros(len(press.t))
    for n, dt in enumerate(steps, start=1):
        fading, gain = np.exp(-dt / tau), tau / dt * -np.expm1(-dt / tau)
        now = elastic
        if n <= press.held:
            now = (press.force[n] - g @ (fading * branch - gain * elastic)) / (1 + g @ gain)
        branch = fading * branch + gain * (now - elastic)
        elastic = now
        out[n] = elastic + g @ branch
    return out


FORMS: dict[str, tuple[Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]], tuple[float, ...]]] = {
    "elastic": (lambda values: (np.zeros(1), np.ones(1)), ()),
    "prony": (lambda values: (np.exp(values[:2]), np.exp(values[2:])), (0.0, 0.0, -1.0, 1.5)),
    "power law": (lambda values: prony_terms(np.exp(values[0]), expit(values[1])), (0.0, -0.5)),
}
"""Forms of a memory: values to (g, tau_s), and where a fit of the values starts."""


def fit_holds(presses: Sequence[Held], form: str) -> tuple[np.ndarray, np.ndarray]:
    """(g, tau_s) of the form, one of FORMS, that predict the presses' holds from their own ramps best."""
    terms, start = FORMS[form]
    if not start:
        return terms(np.zeros(0))

    def missed(values: np.ndarray) -> np.ndarray:
        return np.concatenate([hold_error(press, *terms(values)) for press in presses])

    return terms(least_squares(missed, start, bounds=(-8.0, 8.0)).x)


def hold_error(press: Held, g: np.ndarray, tau_s: np.ndarray) -> np.ndarray:
    """N, predicted less measured after the ramp."""
    return (from_own_ramp(press, g, tau_s) - press.force)[press.held + 1 :]
