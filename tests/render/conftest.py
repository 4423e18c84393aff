"""Models and renderers that the render tests share: made once."""

from __future__ import annotations

import numpy as np
import pytest

from palpate.mechanics.presses.making import of_places

from . import shapes


@pytest.fixture(scope="session")
def block_renderer():
    """A block, large against the tip: 120 x 120 x 80 mm, 30 kPa, linear dent law, sticking."""
    made = shapes.model(shapes.block((0.12, 0.12, 0.08), (8, 8, 5)))
    return shapes.fem(made, dent_law="linear", friction=np.inf)


@pytest.fixture(scope="session")
def cylinder_renderer():
    """The paper's cylinder: radius 40 mm, height 80 mm, 29 kPa."""
    made = shapes.model(shapes.cylinder(0.04, 0.08, (6, 6)), modulus=29e3)
    return shapes.fem(made, dent_law="linear", friction=np.inf)


@pytest.fixture(scope="session")
def thin_renderer():
    """A wall 6 mm thick, 60 mm wide, 40 mm high."""
    made = shapes.model(shapes.block((0.06, 0.006, 0.04), (8, 1, 5)))
    return shapes.fem(made, dent_law="linear")


@pytest.fixture(scope="session")
def one_d_model():
    """A block with four palpations on its top whose 1D parameters differ from left to right."""
    places = np.array([[-0.03, -0.03, 0.05], [-0.03, 0.03, 0.05], [0.03, -0.03, 0.05], [0.03, 0.03, 0.05]])
    k = np.array([200.0, 200.0, 400.0, 400.0])
    fits = {"k_kv": k, "b_kv": 5.0, "k_hc": 10 * k, "b_hc": 20.0, "r_hc": 1.4, "k_v": k, "k_c": 10 * k}
    rows = of_places(
        places, np.tile([0.0, 0.0, 1.0], (4, 1)), 0.005, depth_m=0.005,
        fits={**fits, "r_c": 1.4, "k_h": 10 * k},
    )  # fmt: skip
    return shapes.model(shapes.block((0.1, 0.1, 0.05), (6, 6, 3)), presses=rows)
