"""A block that nobody had to mesh, and what a hand would have recorded on it."""

from __future__ import annotations

import numpy as np
import pytest

import palpate as pp
from palpate.mechanics.recording.recording import Recording

PLACES_M = ((0.0, 0.0), (0.012, 0.0), (0.0, -0.012))
DEPTH_M = 0.003
STIFFER = 1.25


@pytest.fixture(scope="session")
def folder(block_folder):
    """A block of 30 kPa, 60 x 60 x 30 mm, its base at z = 0, as a MODEL folder with its compliance."""
    return block_folder


@pytest.fixture(scope="session")
def felt(folder):
    """The block's renderer."""
    return pp.renderer(folder, friction=np.inf, progress=False)


@pytest.fixture(scope="session")
def curves(felt):
    """A press from above at each of three places."""
    return [pp.press(felt, (x, y, 0.03), depth_m=DEPTH_M, hold_s=0.1) for x, y in PLACES_M]


@pytest.fixture(scope="session")
def recording(curves):
    """The presses one after another, half a second of air around, on an object 1.25 times as stiff."""
    position = np.concatenate([_in_air(c, c.position) for c in curves])
    force = STIFFER * np.concatenate([_in_air(c, c.force, air=0.0) for c in curves])
    return Recording(
        t=np.arange(len(position)) / 1000.0,
        position=position,
        force_on_tool=force,
        sample_rate_hz=1000.0,
        tip_radius_m=0.005,
        force_noise_std_n=0.01,
        object_name="block",
    )


def _in_air(curve, values, air=None):
    ends = (values[0], values[-1]) if air is None else np.full((2, 3), air)
    return np.concatenate([np.tile(ends[0], (500, 1)), values, np.tile(ends[1], (500, 1))])
