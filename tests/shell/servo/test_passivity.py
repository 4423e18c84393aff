"""The passivity observer's books and the controller's bounds, on scripted motions."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.errors import OptionError
from palpate.render.passivity import (
    DISSIPATED,
    NET,
    OWED,
    TOTAL,
    PassivityOptions,
    passivity_after,
    passivity_before,
    passivity_parameters,
    passivity_state,
)

DT = 0.001


def run(positions, forces, *, active=False, **options):
    """Feed (n, 3) positions and wanted forces, each held; returns the state and the (n, 3) forces sent."""
    given = PassivityOptions(passivity=active, **options)
    parameters = passivity_parameters(given, max_damping_n_s_per_m=10.0)
    state, sent, work = passivity_state(), [np.zeros(3)], 0.0
    steps = np.diff(positions, axis=0, prepend=positions[:1])
    for position, force, step in zip(positions, forces, steps, strict=True):
        wanted = np.array(force, dtype=float)
        work += float(sent[-1] @ step)
        passivity_before(parameters, state, wanted, np.array(position, dtype=float), work, True, DT, DT, 0.0)
        passivity_after(state, wanted, wanted)
        sent.append(wanted)
    return state, np.array(sent[1:])


def line(z):
    return np.stack([np.zeros_like(z), np.zeros_like(z), z], axis=1)


def test_the_observed_energy_is_the_held_force_times_the_way():
    random = np.random.default_rng(1)
    positions, forces = 1e-3 * random.normal(size=(50, 3)).cumsum(axis=0), random.normal(size=(50, 3))
    state, _ = run(positions, forces)
    moved = np.diff(positions, axis=0)
    np.testing.assert_allclose(state.energies[TOTAL], -(forces[:-1] * moved).sum(), rtol=1e-12)


def test_what_a_spring_owes_is_half_its_stiffness_times_the_squared_steps():
    k, z = 500.0, -0.001 - 0.002 * np.sin(np.linspace(0.0, 3.0, 400)) ** 2
    state, _ = run(line(z), line(-k * z))
    owed = 0.5 * k * (np.diff(z) ** 2).sum()
    # the first force acts without a force before it
    np.testing.assert_allclose(state.energies[OWED], owed, rtol=0.02)


def test_a_constant_force_owes_nothing():
    z = np.linspace(0.0, -0.01, 200)
    state, _ = run(line(z), line(np.full(200, 1.5)))
    assert abs(state.energies[OWED]) < 1e-5


def test_the_damper_takes_back_what_is_owed_and_opposes_the_motion():
    k = 2000.0
    t = np.arange(2000) * DT
    z = -0.002 * (1.0 - np.cos(2 * np.pi * 4.0 * t))
    plain, _ = run(line(z), line(-k * z))
    state, sent = run(line(z), line(-k * z), active=True)
    assert plain.energies[OWED] > 0.5e-3
    assert abs(state.energies[OWED]) < 0.1 * plain.energies[OWED]
    assert state.energies[DISSIPATED] > 0.5 * plain.energies[OWED]
    extra = sent[:, 2] + k * z
    assert np.corrcoef(extra[100:], -np.gradient(z)[100:])[0, 1] > 0.6


def test_energy_that_never_went_in_does_not_come_out():
    z = np.linspace(0.0, 0.05, 500)
    # the guard sees motion, so the push begins under way
    push = np.where(np.arange(500) < 20, 0.0, 3.0)
    state, sent = run(line(z), line(push), active=True, allowance_j=1e-4)
    # 150 mJ were asked for; forgiven power is 0.05 mW
    assert -state.energies[TOTAL] < 1.5e-4
    assert sent[-1, 2] < 0.1


def test_a_passive_push_is_left_alone():
    z = np.linspace(0.0, -0.01, 500)
    _, sent = run(line(z), line(np.full(500, 3.0)), active=True)
    # it begins at 3 N out of nothing: let in as the energy comes that it could give back
    np.testing.assert_allclose(sent[40:, 2], 3.0, rtol=1e-3)


def test_what_was_dissipated_in_one_contact_is_no_licence_for_the_next():
    into, rest = np.linspace(0.0, -0.01, 300), np.full(50, -0.01)
    z = np.concatenate([into, rest])
    force = np.concatenate([np.full(300, 2.0), np.zeros(50)])
    state, _ = run(line(z), line(force), active=True)
    assert state.energies[TOTAL] > 0.015
    assert state.energies[NET] <= 0.0


def test_impossible_settings_are_refused():
    with pytest.raises(OptionError, match="delay_ticks"):
        passivity_parameters(PassivityOptions(), max_damping_n_s_per_m=1.0, delay_ticks=1000.0)
    with pytest.raises(OptionError, match="allowance_j"):
        PassivityOptions(allowance_j=0.0)
