"""A place is heard by the error of its own modulus, however few rows it has: tissue as robots sample it."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks._tissue import tissue
from palpate.mechanics.compliance.pressed_places import places_at
from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.presses.table import Presses
from palpate.reconstruction.steps.s7_modulus.modulus import fit_modulus
from palpate.reconstruction.steps.s7_modulus.modulus_field import (
    asked_for,
    fit_field,
    press_moduli,
    with_field,
)

ROWS = (3, 5, 10, 100)
FOLDS = 3


def sampled(presses: Presses, rows: int) -> Presses:
    """So many rows of each loading, evenly from just above the surface to the deepest."""
    each = int(np.diff(presses.starts)[0])
    chosen = np.zeros(each, dtype=bool)
    chosen[np.linspace(1, each // 2 - 1, rows).round().astype(int)] = True
    return presses.where(np.tile(chosen, len(presses)))


@pytest.fixture(scope="module")
def slab():
    made = tissue(1, raster=6, touch_error_m=1e-4)
    presses = made.presses
    return made, touch_sites(made.model.mesh, presses.point, presses.normal, 0.49)


@pytest.fixture(scope="module")
def held_out(slab):
    """Rows a place -> (rms error, N, of all rows of presses that were held out; folds that asked for a
    field)."""
    made, sites = slab
    whole = made.presses
    fold = np.random.default_rng(0).permutation(np.arange(len(whole)) % FOLDS)
    found = {}
    for rows in ROWS:
        few = sampled(whole, rows)
        places = places_at(made.model, few, sites)
        own = press_moduli(few, sites, places, made.law, whole.noise.raw_n)
        asked, missed = 0, np.zeros(len(whole.press))
        for k in range(FOLDS):
            field = fit_field(own, np.flatnonzero(fold != k))
            if field is None or not asked_for(field):
                continue
            asked += 1
            forces = np.exp(field.level) * with_field(sites, places, field.field).unit_forces(whole, made.law)
            held = (fold == k)[whole.press]
            missed[held] = ((forces - whole.force) ** 2).sum(axis=1)[held]
        found[rows] = float(np.sqrt(missed.mean())), asked
    return found


@pytest.mark.slow
def test_few_rows_a_place_ask_for_the_same_field(held_out):
    assert {rows: asked for rows, (_, asked) in held_out.items()} == dict.fromkeys(ROWS, FOLDS)


@pytest.mark.slow
def test_held_out_presses_are_predicted_as_well_as_from_a_hundred_rows(held_out):
    for rows, worse in ((5, 0.10), (10, 0.05)):
        assert held_out[rows][0] < (1 + worse) * held_out[100][0]


@pytest.mark.slow
def test_a_modulus_of_few_rows_is_less_sure(slab):
    made, sites = slab
    presses, errors, off = made.presses, [], []
    dense = press_moduli(presses, sites, places_at(made.model, presses, sites), made.law, presses.noise.raw_n)
    for rows in ROWS:
        few = sampled(made.presses, rows)
        own = press_moduli(few, sites, places_at(made.model, few, sites), made.law, few.noise.raw_n)
        assert own.usable.all()
        errors.append(float(np.median(own.fit.relative_error)))
        off.append(float(np.std(np.log(own.fit.modulus_pa / dense.fit.modulus_pa))))
    assert errors[0] > 1.2 * errors[1] > 1.2 * 1.2 * errors[2]
    assert errors[2] == pytest.approx(errors[3], rel=0.1)
    assert (np.array(off) < errors).all()


@pytest.mark.slow
def test_depths_are_weighed_by_evidence_with_ten_rows_a_place_too():
    """A body that stiffens with depth: the deep rows are left out, few as they are."""
    made = tissue(2, raster=5, log_sd=0.0)
    presses = made.presses
    sites = touch_sites(made.model.mesh, presses.point, presses.normal, 0.49)
    random = np.random.default_rng(0)
    deep = 0.006 * random.uniform(0.9, 1.0, len(presses))
    chosen = []
    for rows in (10, 100):
        few = sampled(presses, rows)
        scale = (deep / presses.depth_m)[few.press]
        into = np.maximum(few.depth * scale, 0.0)
        moved = few.centre[few.press] - (few.depth * scale)[:, None] * few.normal[few.press]
        few = few.where(np.ones(len(few.press), dtype=bool))
        object.__setattr__(few, "position", moved)
        force = made.forces(few) * (1 + 0.6 * np.clip((into - 0.003) / 0.003, 0, None))[:, None]
        object.__setattr__(few, "force", force + 0.003 * random.standard_normal(force.shape))
        fit = fit_modulus(few, sites, 0.003)
        chosen.append((fit.press.depth_m, fit.modulus_pa))
    assert max(depth for depth, _ in chosen) < 0.0055
    assert chosen[0][1] == pytest.approx(chosen[1][1], rel=0.05)
