"""The far field on another support equals what a new factorisation of that support gives."""

from __future__ import annotations

import numpy as np
import pytest

from diagnose.fields import energy_fields
from diagnose.forward import build_forward
from diagnose.support_motion import far_on_springs, far_partly_bonded, loosened, support_axes, support_motion
from diagnose.touches import touches_of
from mechanics.patch import PatchSampler
from mechanics.refine import typical_edge
from mechanics.solver import Solver
from mechanics.support import BaseHold


@pytest.fixture(scope="module")
def forward(bench):  # type: ignore[no-untyped-def]
    recording, model = bench.record()
    return build_forward(touches_of(model.presses), model)


def _give(forward, hold):  # type: ignore[no-untyped-def]
    """(q, 3, 3) added by a support, by factorising it."""
    fields = energy_fields(forward)
    mesh, t = fields.solver.mesh, forward.touches
    sampler = PatchSampler(mesh, 0.8 * typical_edge(mesh))
    presses = [int(np.flatnonzero(fields.place == q)[0]) for q in range(len(fields.energy))]
    forces = np.zeros((len(mesh.points), 3, 3 * len(presses)))
    for k, press in enumerate(presses):
        nodes, weights = sampler.weights(t.point[press])
        for axis in range(3):
            forces[nodes, :, 3 * k + axis] = weights[:, None] * t.frame[press][axis]
    other = Solver(mesh, forward.nu, hold=hold)
    both = [Solver(mesh, forward.nu).solve(forces), other.solve(forces)]
    flat = forces.reshape(-1, len(presses), 3)
    work = [np.einsum("fqi,fqj->qij", flat, u.reshape(flat.shape)) for u in both]
    return work[1] - work[0]


@pytest.mark.parametrize(("normal", "tangential"), [(25.0, 25.0), (60.0, 20.0)])
def test_springs(forward, normal, tangential):
    expected = _give(forward, BaseHold(np.array([0, 0, 1.0]), springs=(normal, tangential)))
    got = far_on_springs(forward, normal, tangential) - forward.far
    place = energy_fields(forward).place
    # the base moves linearly between nodes 10 mm apart here, quadratically in the factorised solution
    np.testing.assert_allclose(got[:, 0, 0], expected[place][:, 0, 0], rtol=0.1)
    np.testing.assert_allclose(got, expected[place], atol=0.2 * np.abs(expected).max())


def test_partly_loose(forward):
    across, _ = support_axes(forward.model)
    # the same rows of nodes let go: here nodes are freed, there triangles
    expected = _give(forward, BaseHold(np.array([0, 0, 1.0]), bonded_fraction=0.26, direction=across))
    got = loosened(support_motion(forward), 0.6, 0.0)[0]
    np.testing.assert_allclose(got[:, 0, 0], expected[:, 0, 0], rtol=0.2, atol=1.0)


def test_a_floor_carries_what_presses_on_it(forward):
    bare = far_partly_bonded(forward, 0.5, 0.0, floor=0.0)[:, 0, 0]
    carried = far_partly_bonded(forward, 0.5, 0.0, floor=1.0)[:, 0, 0]
    bonded = forward.far[:, 0, 0]
    assert (carried <= bare + 1e-6).all() and (carried >= bonded - 1e-6).all()
    on_top = forward.touches.normal[:, 2] > 0.9
    assert (carried - bonded)[on_top].max() < 0.5 * (bare - bonded)[on_top].max()
