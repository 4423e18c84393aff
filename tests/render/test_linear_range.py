"""The depth at which finite strain is felt: deeper with a larger tip, and shown by the renderer itself."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.compliance.sites import touch_sites
from palpate.mechanics.contact.linear_range import linear_range
from palpate.mechanics.elastic.solver import Solver
from palpate.render.fem.renderer import FemRenderer
from palpate.render.options import RenderOptions
from palpate.render.press import Stroke, press

from . import shapes


def test_the_linear_range_scales_with_the_tip_on_a_half_space_and_marks_the_renderers_own_error():
    made = shapes.model(shapes.block((0.12, 0.12, 0.08), (6, 6, 4)))
    solver = Solver(made.mesh, 0.49)
    at = np.array([[0.0, 0.0, 0.08]])
    sites = touch_sites(made.mesh, at, [[0, 0, 1.0]], 0.49, solver=solver)
    share = 0.03
    found = linear_range(sites, 0.005, share)["depth_median_m"]
    assert 0.001 < found < 0.0125
    larger = linear_range(sites, 0.008, share)["depth_median_m"]
    assert larger > 1.3 * found
    compliance = shapes.quick_compliance(made)
    force = {}
    for law in ("linear", "neo-hookean"):
        renderer = FemRenderer(made, RenderOptions(dent_law=law), compliance=compliance)
        curve = press(renderer, at[0], [0, 0, -1], Stroke(found, 0.05))
        force[law] = curve.force_at(curve.depth.max())[2]
    assert abs(force["linear"] / force["neo-hookean"] - 1) == pytest.approx(share, abs=0.006)
