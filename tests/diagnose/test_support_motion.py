"""The far field on another support equals what a new factorisation of that support gives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from palpate.diagnosis.forward.prediction import build_forward
from palpate.diagnosis.forward.touches import touches_of
from palpate.mechanics.compliance import support_motion as support
from palpate.mechanics.compliance.far_field import energy_fields
from palpate.mechanics.compliance.patch import PatchSampler
from palpate.mechanics.compliance.support_motion import (
    far_on_springs,
    far_partly_bonded,
    few_corners,
    loosened,
    support_motion,
)
from palpate.mechanics.elastic.held_base import BaseHold
from palpate.mechanics.elastic.solver import Solver
from palpate.mechanics.frames import tangents
from palpate.mechanics.shape.refine import typical_edge


@pytest.fixture(scope="module")
def places(bench):
    recording, model = bench.record()
    return build_forward(touches_of(model.presses), model).places


def _compliance(places, hold):
    """(q, 3, 3) added by a support, by factorising it."""
    fields = energy_fields(places)
    mesh = fields.solver.mesh
    sampler = PatchSampler(mesh, 0.8 * typical_edge(mesh))
    presses = places.first
    forces = np.zeros((len(mesh.points), 3, 3 * len(presses)))
    for k, press in enumerate(presses):
        nodes, weights = sampler.weights(places.point[press])
        for axis in range(3):
            forces[nodes, :, 3 * k + axis] = weights[:, None] * places.frame[press][axis]
    other = Solver(mesh, places.model.material.poisson_ratio, hold=hold)
    both = [Solver(mesh, places.model.material.poisson_ratio).solve(forces), other.solve(forces)]
    flat = forces.reshape(-1, len(presses), 3)
    work = [np.einsum("fqi,fqj->qij", flat, u.reshape(flat.shape)) for u in both]
    return work[1] - work[0]


@pytest.mark.parametrize(("normal", "tangential"), [(25.0, 25.0), (60.0, 20.0)])
def test_springs(places, normal, tangential):
    expected = _compliance(places, BaseHold(np.array([0, 0, 1.0]), springs=(normal, tangential)))
    got = far_on_springs(places, normal, tangential) - places.far
    place = places.place
    # the base moves linearly between nodes 10 mm apart here, quadratically in the factorised solution
    np.testing.assert_allclose(got[:, 0, 0], expected[place][:, 0, 0], rtol=0.1)
    np.testing.assert_allclose(got, expected[place], atol=0.2 * np.abs(expected).max())


def test_points_of_a_plane_follow_some_of_them():
    """Rigid motion, which is linear, comes out exactly, within the chosen ones and beyond."""
    random = np.random.default_rng(0)
    angle, radius = random.uniform(0, 2 * np.pi, 900), 0.05 * np.sqrt(random.uniform(size=900))
    plane = np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
    chosen, drawn = few_corners(plane)
    assert len(chosen) == support.MOST_CORNERS and drawn.shape == (900, len(chosen))
    np.testing.assert_allclose(drawn.sum(axis=1), 1.0)
    np.testing.assert_allclose(drawn @ plane[chosen], plane, atol=1e-12)
    np.testing.assert_allclose(drawn[chosen].toarray(), np.eye(len(chosen)), atol=1e-9)
    # no point is thrown far by the others
    assert np.abs(drawn).max() < 3


def test_a_base_of_many_corners_gives_as_much_when_some_of_them_move_it(places, monkeypatch):
    whole = far_on_springs(places, 25.0, 25.0) - places.far
    corners = len(support_motion(places).plane)
    monkeypatch.setattr(support, "MOST_CORNERS", corners // 2)
    # a model without a folder keeps nothing that was solved before
    few = replace(places, stages={}, model=replace(places.model, path=None))
    got = far_on_springs(few, 25.0, 25.0) - places.far
    assert len(support_motion(few).plane) == corners // 2
    np.testing.assert_allclose(got[:, 0, 0], whole[:, 0, 0], rtol=0.1)


def test_partly_loose(places):
    across, _ = tangents(places.model.support.normal)
    # the same rows of nodes let go: here nodes are freed, there triangles
    expected = _compliance(places, BaseHold(np.array([0, 0, 1.0]), bonded_fraction=0.26, direction=across))
    got = loosened(support_motion(places), 0.6, 0.0)[0]
    np.testing.assert_allclose(got[:, 0, 0], expected[:, 0, 0], rtol=0.2, atol=1.0)


def test_a_floor_carries_what_presses_on_it(places):
    bare = far_partly_bonded(places, 0.5, 0.0, floor=0.0)[:, 0, 0]
    carried = far_partly_bonded(places, 0.5, 0.0, floor=1.0)[:, 0, 0]
    bonded = places.far[:, 0, 0]
    assert (carried <= bare + 1e-6).all() and (carried >= bonded - 1e-6).all()
    on_top = places.normal[:, 2] > 0.9
    assert (carried - bonded)[on_top].max() < 0.5 * (bare - bonded)[on_top].max()
