"""Laws of time in tissue are told apart: drainage by the contact's radius, a power of time by two numbers."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
from palpate.diagnosis.search.attribution import _best_law
from palpate.diagnosis.search.evidence import Search
from palpate.diagnosis.search.rivals import of_one_phenomenon
from palpate.mechanics.effects.registry import effect, effects

RADIUS, SHARE, DIFFUSIVITY = 0.005, 0.4, 4e-5


def drained(bench, t, x, f):
    """The force with its fluid's share: the master curve summed over the changes of force, press by press."""
    out, pressing = f.copy(), np.linalg.norm(f, axis=1) > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], pressing, [0]])))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        from_place = x[a:b, None] - (bench.points + RADIUS * bench.normals)
        depths = -np.einsum("nki,ki->nk", from_place, bench.normals)
        place = int(np.argmin(np.linalg.norm(from_place, axis=2).max(axis=0)))
        depth = np.maximum(depths[:, place], 1e-5)
        clock = np.cumsum(DIFFUSIVITY / (RADIUS * depth)) * (t[a + 1] - t[a])
        since = np.maximum(clock[:, None] - clock[None, :], 0.0)
        left = np.tril(0.491 * np.exp(-0.908 * np.sqrt(since)) + 0.509 * np.exp(-1.679 * since))
        out[a:b] += SHARE * left @ np.diff(f[a:b], axis=0, prepend=0.0)
        out[a:b][(out[a:b] * bench.normals[place]).sum(axis=1) < 0] = 0.0
    return x, out


def powered(t, x, f):
    """The force beside a springpot, share 0.25 and exponent 0.3, press by press."""
    out, pressing = f.copy(), np.linalg.norm(f, axis=1) > 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], pressing, [0]])))
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        dt = t[a + 1] - t[a]
        kernel = np.diff((dt * np.arange(b - a + 1)) ** 0.7) / (0.7 * dt)
        change = np.diff(f[a:b], axis=0, prepend=0.0)
        extra = np.stack([np.convolve(c, kernel)[: b - a] for c in change.T], axis=1)
        pull = ((f[a:b] + 0.25 * extra) * f[a:b]).sum(axis=1) < 0
        out[a:b] = np.where(pull[:, None], 0.0, f[a:b] + 0.25 * extra)
    return x, out


def searched(recorded):
    _, model = recorded
    forward = build_forward(touches_of(model.presses), model)
    return Search(
        forward, 20e3, nuisance=NuisanceOptions(), options=AttributionOptions(), site_sd=None,
        finite_strain=effect("finite_strain"),
    )  # fmt: skip


def scores(search, names):
    base = search.judge([search.finite_strain])
    return {
        name: search.score([effect(name)], search.judge([search.finite_strain, effect(name)]), base)
        for name in names
    }


@pytest.mark.slow
def test_drainage_is_told_from_viscosity_by_the_contacts_radius(bench):
    search = searched(bench.record(lambda t, x, f: drained(bench, t, x, f)))
    found = scores(search, ("poroelasticity", "viscoelasticity", "power_law_relaxation"))
    assert found["poroelasticity"].gain > max(
        found["viscoelasticity"].gain, found["power_law_relaxation"].gain
    )
    values = found["poroelasticity"].candidate.found.of("poroelasticity")
    keys = effect("poroelasticity").report(values, search.forward, 20e3)
    assert keys["share"] == pytest.approx(SHARE, rel=0.15)
    assert keys["diffusivity_m2_per_s"] == pytest.approx(DIFFUSIVITY, rel=0.2)


@pytest.mark.slow
def test_a_power_of_time_is_named_by_its_two_numbers(bench):
    search = searched(bench.record(powered))
    found = scores(search, ("viscoelasticity", "power_law_relaxation"))
    best = max(found.values(), key=lambda score: score.gain)
    others = [score for score in found.values() if score is not best]
    assert _best_law(search, others, best).name == "power_law_relaxation"
    share, exponent = found["power_law_relaxation"].candidate.found.of("power_law_relaxation")
    assert share == pytest.approx(0.25, rel=0.2) and exponent == pytest.approx(0.3, abs=0.05)


def test_laws_of_one_phenomenon_are_no_rivals():
    pairs = {
        frozenset((a.name, b.name)) for a in effects() for b in effects() if of_one_phenomenon(a, [b])
    }  # fmt: skip
    assert pairs == {
        frozenset(("viscoelasticity", "power_law_relaxation")),
        frozenset(("adhesion", "jkr_adhesion")),
    }  # fmt: skip
