"""Palpation of a half-space by mechanics alone, on any raster: no tracing, the truth known."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at
from palpate.mechanics.recording.recording import Recording

MODULUS_PA, TIP_M, NOISE_N = 12e3, 0.004, 0.004


def raster(
    count: tuple[int, int] = (5, 5),
    pitch_m: float = 0.005,
    *,
    depth_m: float = 0.003,
    rate_hz: float = 200.0,
    press_s: float = 1.2,
    rise_m: float = 0.002,
    tilt: bool = True,
    seed: int = 0,
) -> Recording:
    """Straight presses at the points of a grid, each from free air; the ground tilted and shifted at
    random."""
    rng = np.random.default_rng(seed)
    xs, ys = ((np.arange(n) - (n - 1) / 2) * pitch_m for n in count)
    places = np.array([[x, y, 0.0] for x in xs for y in ys])
    n = round(press_s * rate_hz / 2)
    swing = np.minimum(np.arange(2 * n) / n, 2 - np.arange(2 * n) / n)
    height = rise_m - (rise_m + depth_m * rng.uniform(0.8, 1.1, (len(places), 1))) * swing
    up = np.array([0.0, 0.0, 1.0])
    path = np.minimum(height, 0)[..., None] * up
    sites = TouchSites(
        places,
        np.tile(up, (len(places), 1)),
        np.zeros(len(places)),
        np.zeros((len(places), 3, 3)),
        0.005,
        0.49,
    )
    force = forces_at(
        sites,
        path.reshape(-1, 3),
        2 * n * np.arange(len(places) + 1),
        young_modulus_pa=MODULUS_PA,
        tip_radius_m=TIP_M,
        law="linear",
    )
    position = (places[:, None] + (height + TIP_M)[..., None] * up).reshape(-1, 3)
    turn = Rotation.random(rng=rng) if tilt else Rotation.identity()
    shift = rng.uniform(-0.2, 0.2, 3) if tilt else np.zeros(3)
    return Recording(
        t=np.arange(len(position)) / rate_hz,
        position=turn.apply(position) + shift,
        force_on_tool=turn.apply(force) + NOISE_N * rng.standard_normal(force.shape),
        sample_rate_hz=rate_hz,
        tip_radius_m=TIP_M,
        force_noise_std_n=NOISE_N,
        object_name="ground",
    )
