"""Models and renderers that the render tests share: made once."""

from __future__ import annotations

import numpy as np
import pytest

from mechanics.palpation import Palpation

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
    rows = [
        Palpation(
            t_onset=float(i), t_peak=i + 0.5, x=x, y=y, z=0.05, nx=0.0, ny=0.0, nz=1.0, depth=0.005,
            k_kv=k, b_kv=5.0, k_hc=10 * k, b_hc=20.0, r_hc=1.4, k_v=k, k_c=10 * k, r_c=1.4, k_h=10 * k,
        )
        for i, (x, y, k) in enumerate(
            [(-0.03, -0.03, 200.0), (-0.03, 0.03, 200.0), (0.03, -0.03, 400.0), (0.03, 0.03, 400.0)]
        )
    ]  # fmt: skip
    return shapes.model(shapes.block((0.1, 0.1, 0.05), (6, 6, 3)), palpations=tuple(rows))
