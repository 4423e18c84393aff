"""Laws of tissue along the path of a touch, against closed forms and direct sums."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.effects.jkr_adhesion import _set as set_adhesion
from palpate.mechanics.effects.jkr_adhesion import edge_share
from palpate.mechanics.effects.law import PathLaw
from palpate.mechanics.effects.poroelasticity import LAW as POROELASTIC
from palpate.mechanics.effects.power_law_relaxation import LONGEST_S, SHORTEST_S, prony_terms
from palpate.mechanics.effects.settings import TouchTerms
from palpate.mechanics.effects.viscoelasticity import LAW as PRONY

NORMAL = np.array([0.0, 0.0, 1.0])


def stepped(law: PathLaw, numbers: np.ndarray, depth: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
    """(n,) N along the normal, from quasi-static forces (n,) at depths (n,) m, dt s apart."""
    memory, out, deepest = np.zeros(law.memory(numbers)), np.empty(len(depth)), 0.0
    for i, (d, f) in enumerate(zip(depth, force, strict=True)):
        three = f * NORMAL
        deepest = max(deepest, d)
        law.step(numbers, memory, d, deepest, 0.0, 0.0, dt if i else 0.0, NORMAL, three)
        out[i] = three[2]
        if d <= -law.reach(numbers):
            memory[:], deepest = 0.0, 0.0
    return out


# --- relaxation by a power of time


@pytest.mark.parametrize(("exponent", "error"), [(0.05, 0.01), (0.3, 0.01), (0.45, 0.011), (0.9, 0.035)])
def test_few_prony_terms_are_a_power_of_time(exponent, error):
    t = np.geomspace(SHORTEST_S, LONGEST_S, 500)
    g, tau = prony_terms(0.4, exponent)
    assert (g >= 0).all() and len(g) <= 8
    assert np.exp(-t[:, None] / tau) @ g == pytest.approx(0.4 * t**-exponent, rel=error)


def test_a_ramp_and_hold_relaxes_as_the_fractional_integral():
    share, exponent, dt, ramp = 0.5, 0.3, 2e-3, 0.4
    t = np.arange(0, 20, dt)
    force = np.minimum(t / ramp, 1.0)
    rest = 1 - exponent
    integral = (t**rest - np.maximum(t - ramp, 0) ** rest) / (rest * ramp)  # of a power over the ramp
    numbers = np.column_stack(prony_terms(share, exponent)).ravel()
    found = stepped(PRONY, numbers, force, force, dt)
    assert found[50:] == pytest.approx((force + share * integral)[50:], rel=0.01)


# --- drainage


def master(x: np.ndarray) -> np.ndarray:
    """Hu, Zhao, Vlassak & Suo (2010), a sphere held at a depth."""
    return 0.491 * np.exp(-0.908 * np.sqrt(x)) + 0.509 * np.exp(-1.679 * x)


def held(depth: float, radius: float, diffusivity: float, t: np.ndarray) -> np.ndarray:
    force = np.full(len(t), 2.0)
    numbers = np.array([0.4, diffusivity / radius])
    return stepped(POROELASTIC, numbers, np.full(len(t), depth), force, t[1] - t[0])


def test_a_held_sphere_drains_by_the_master_curve():
    t, radius, depth, diffusivity = np.arange(0, 3, 2e-3), 5e-3, 2e-3, 1e-5
    clock = diffusivity * t / (radius * depth)
    found = held(depth, radius, diffusivity, t)
    assert found == pytest.approx(2.0 * (1 + 0.4 * master(clock)), rel=0.003)


@pytest.mark.parametrize(("radius", "depth"), [(5e-3, 4e-3), (1e-2, 2e-3), (5e-6, 2e-6)])
def test_the_time_to_drain_goes_with_the_square_of_the_contacts_radius(radius, depth):
    def half(r: float, d: float, diffusivity: float) -> float:
        t = np.linspace(0, 3 * r * d / diffusivity, 4000)
        excess = held(d, r, diffusivity, t) / 2.0 - 1
        return float(t[np.argmax(excess < 0.2)]) * diffusivity

    assert half(radius, depth, 1e-5) / half(5e-3, 2e-3, 1e-5) == pytest.approx(
        radius * depth / (5e-3 * 2e-3), rel=0.01
    )


# --- adhesion

E_STAR = 20e3


def sticky(
    work: float, radius: float, depth: np.ndarray, *, healed: float = 1.0, reach: float | None = None,
    give: float = 0.0,
) -> np.ndarray:  # fmt: skip
    """(n,) N on a half-space, in series with a spring that gives `give` m/N."""
    touch = TouchTerms()
    keys = {"work_j_per_m2": work, "healed": healed, "range_m": reach or 1e-7 * radius}
    set_adhesion(touch, keys, E_STAR, 0.0, radius)
    ((law, numbers),) = touch.numbers.items()
    dent = np.linspace(0, 2 * radius, 20001)
    hertz = 4 / 3 * E_STAR * np.sqrt(radius) * dent**1.5
    elastic = np.interp(np.maximum(depth, 0.0), dent + give * hertz, hertz)
    return stepped(law, numbers, depth, elastic, 1e-3)


def there_and_back(radius: float, deep: float = 0.1, high: float = 0.2, steps: int = 4000) -> np.ndarray:
    return radius * np.concatenate([np.linspace(-0.01, deep, steps), np.linspace(deep, -high, 2 * steps)])


@pytest.mark.parametrize("radius", [5e-3, 1e-5])
def test_jkr_snaps_in_and_lets_go_as_its_closed_form_at_any_scale(radius):
    work = 0.004 * E_STAR * radius
    depth = there_and_back(radius)
    force = sticky(work, radius, depth)
    pull_off = 1.5 * np.pi * work * radius
    touch = int(np.argmax(depth > 0))
    assert force[:touch] == pytest.approx(0.0, abs=1e-12)
    assert force[touch] == pytest.approx(-8 / 9 * pull_off, rel=0.02)  # JKR at no indentation
    # a tip held by a machine lets go below the greatest pull, at 5/9 of it
    assert force.min() == pytest.approx(-pull_off, rel=1e-3)
    last = np.flatnonzero(force)[-1]
    assert force[last] == pytest.approx(-5 / 9 * pull_off, rel=0.03)
    a = (np.pi * work * radius**2 / (8 * E_STAR)) ** (1 / 3)
    assert depth[last] == pytest.approx(-3 * a**2 / radius, rel=0.01)


def test_what_a_cycle_takes_is_the_work_of_snapping_in_and_letting_go():
    """Where the edge is not pinned the way back is the way in, but for what the instabilities leave."""
    radius, work = 5e-3, 0.4
    depth = there_and_back(radius)
    force = sticky(work, radius, depth)
    turn = int(np.argmax(depth))
    into, out = force[:turn], np.interp(-depth[:turn], -depth[turn:], force[turn:])
    inside = depth[:turn] > 0
    assert into[inside] == pytest.approx(out[inside], abs=1e-4 * np.abs(force).max())


def test_a_contact_that_heals_less_has_a_pinned_edge_at_the_turn():
    radius, work = 5e-3, 0.4
    depth = there_and_back(radius)
    none, some = (sticky(work, radius, depth, healed=h) for h in (0.0, 0.3))
    turn = int(np.argmax(depth))
    hertz = 4 / 3 * E_STAR * np.sqrt(radius) * np.maximum(depth, 0) ** 1.5
    assert none[: turn + 1] == pytest.approx(hertz[: turn + 1], abs=1e-6)
    assert none.min() == pytest.approx(some.min(), rel=1e-3)
    # a flat punch of the contact's radius, just past the turn
    a = np.sqrt(radius * depth[turn])
    slope = (none[turn] - none[turn + 20]) / (depth[turn] - depth[turn + 20])
    assert slope == pytest.approx(2 * E_STAR * a, rel=0.01)


def test_an_object_that_gives_lets_go_later_and_at_more_of_the_pull():
    radius, work = 5e-3, 0.4
    depth = there_and_back(radius, steps=8000)
    stiff, soft = (sticky(work, radius, depth, give=c) for c in (0.0, 1 / (2 * E_STAR * radius)))
    assert stiff.min() == pytest.approx(soft.min(), rel=1e-3)
    assert depth[np.flatnonzero(soft)[-1]] < depth[np.flatnonzero(stiff)[-1]]
    assert soft[np.flatnonzero(soft)[-1]] < 1.1 * stiff[np.flatnonzero(stiff)[-1]]


def test_a_wide_range_is_dmt_and_a_short_one_jkr():
    radius, work = 5e-3, 0.002 * E_STAR * 5e-3
    depth = there_and_back(radius, high=1.0)
    unit = np.pi * work * radius
    assert edge_share(work, 1e-9, E_STAR, radius) > 0.999
    assert edge_share(work, 0.5 * radius, E_STAR, radius) < 0.05
    force = sticky(work, radius, depth, reach=0.5 * radius)
    assert force.min() == pytest.approx(-2 * unit, rel=0.03)
    # Dugdale's constant attraction: what is left falls in a straight line to nothing at its range
    assert np.interp(0.25 * radius, -depth[4000:], force[4000:]) == pytest.approx(-unit, rel=0.05)


def test_between_the_limits_the_pull_off_is_maugis():
    """Maugis's Dugdale solution: at lambda = 1 the pull-off is 1.61 pi w R (his figure 7: 1.6)."""
    radius, work = 5e-3, 0.2
    reach = (radius * work**2 / (E_STAR**2 * (1 / 1.157) ** 3)) ** (1 / 3)
    share = edge_share(work, reach, E_STAR, radius)
    assert 2 - 0.5 * share == pytest.approx(1.60, abs=0.02)
