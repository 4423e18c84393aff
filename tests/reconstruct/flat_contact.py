"""Contact with flat ground that never breaks, and points without a time: as other people's files look."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.contact.dent import dent_law
from palpate.mechanics.recording.recording import Recording

from .flat_ground import MODULUS_PA, NOISE_N, TIP_M


def pushed(depth: np.ndarray) -> np.ndarray:
    """N, normal force of the ground at depths (n,) m."""
    return np.asarray(dent_law("linear").force(np.maximum(depth, 0.0), MODULUS_PA, 0.49, TIP_M))


def recorded(
    position: np.ndarray, normal_n: np.ndarray, rate_hz: float, noise_n: float, seed: int = 0
) -> Recording:
    """The recording of a path over the ground z = 0."""
    noise = noise_n * np.random.default_rng(seed).standard_normal((len(position), 3))
    return Recording(
        t=np.arange(len(position)) / rate_hz,
        position=position,
        force_on_tool=np.column_stack([0 * normal_n, 0 * normal_n, normal_n]) + noise,
        sample_rate_hz=rate_hz,
        tip_radius_m=TIP_M,
        force_noise_std_n=noise_n,
        object_name="ground",
    )


def cyclic(
    count: int = 4, pitch_m: float = 0.006, repeats: int = 2, *, noise_n: float = NOISE_N, seed: int = 0
) -> Recording:
    """Presses on a raster between depths of 1 and about 3 mm; the tip goes from place to place in contact."""
    rng = np.random.default_rng(seed)
    places = [(x * pitch_m, y * pitch_m) for x in range(count) for y in range(count)]
    rate, path = 200.0, []
    at = np.array([*places[0], 0.0])
    for place in places:
        to = np.array([*place, 0.0])
        way = np.linspace(0, 1, 60)[:, None]
        path.append(at + way * (to - at) + [0, 0, TIP_M - 0.001])
        for _ in range(repeats):
            deep = 0.001 + 0.002 * rng.uniform(0.8, 1.2) * np.sin(np.linspace(0, np.pi, 200)) ** 2
            path.append(to + np.column_stack([0 * deep, 0 * deep, TIP_M - deep]))
        at = to
    position = np.concatenate(path)
    return recorded(position, pushed(TIP_M - position[:, 2]), rate, noise_n, seed)


def points(
    shape: tuple[int, int] = (5, 5),
    pitch_m: float = 0.005,
    rows: int = 6,
    *,
    by_depth: bool = False,
    noise_n: float = NOISE_N,
    seed: int = 0,
) -> Recording:
    """A raster of quasi-static points, `rows` a place from just above the ground inwards."""
    rng = np.random.default_rng(seed)
    top = 2e-4 * rng.standard_normal(shape)
    depth = np.linspace(-0.0003, 0.003, rows)
    grid = np.array(
        [
            [x * pitch_m, y * pitch_m, top[x, y] + TIP_M - d, d]
            for x in range(shape[0])
            for y in range(shape[1])
            for d in depth
        ]
    )
    if by_depth:
        grid = grid.reshape(-1, rows, 4).transpose(1, 0, 2).reshape(-1, 4)
    made = recorded(grid[:, :3], pushed(grid[:, 3]), 100.0, noise_n, seed)
    object.__setattr__(made, "description", {"recording": {"quasi_static": True}})
    return made
