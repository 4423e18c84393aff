"""Free air: what the force sensor reads while nothing is touched settles bias, drift and the tool's own
mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.kinematics import acceleration
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import runs
from palpate.mechanics.statistics import all_but_one, jackknife_covariance

BLOCK_S = 0.25
MIN_BLOCKS = 8
STRETCHES = 8
"""Of time, left out in turn for standard errors: what wanders is no bias and no drift."""
LEAST_TURN = 0.02
"""Standard deviation of the rotation's entries from which a force that turns with the tool can be seen."""


@dataclass(frozen=True)
class FreeAir:
    """Block means of free-air samples. t: (b,) s. force: (b, 3) N. noise_n: std of one component of one
    block.

    acceleration, inertia_force: (m, 3) m/s^2 and N, smoothed free-air samples where the hand accelerates.
    bias_n: (3,) mean; bias_se_n its standard error. rate_n_per_s, rate_se: (3,) drift. mass_kg, mass_se_kg:
    of force against acceleration. seconds: of free air.
    """

    t: np.ndarray
    force: np.ndarray
    noise_n: float
    seconds: float
    bias_n: np.ndarray
    bias_se_n: float
    rate_n_per_s: np.ndarray
    rate_se_n_per_s: float
    mass_kg: float
    mass_se_kg: float
    turning: Turning | None = None

    @property
    def p(self) -> float:
        """That bias, drift and mass (seven numbers) are all chance (Bonferroni)."""
        z = max(
            np.abs(self.bias_n).max() / self.bias_se_n,
            np.abs(self.rate_n_per_s).max() / self.rate_se_n_per_s,
            abs(self.mass_kg) / self.mass_se_kg,
        )
        return float(min(1.0, 7 * chi2.sf(z**2, 1)))


@dataclass(frozen=True)
class Turning:
    """A force that turns with the tool, as a tared tool's weight does: R(t) tool_n in the device frame.

    tool_n: (3,) N, tool frame; se_n: standard error of a component. first: (3, 3) R at the recording's start.
    """

    tool_n: np.ndarray
    se_n: float
    first: np.ndarray


def free_air_of(recording: Recording, presses: Presses) -> FreeAir | None:
    """Analyse the free air that the table names; None with less than two seconds of it."""
    free, noise_n = presses.within("free", recording.t), presses.noise.raw_n
    rate = recording.sample_rate_hz
    if free.sum() < 2 * rate:
        return None
    t, force = recording.t, recording.force_on_tool
    size = max(1, round(BLOCK_S * rate))
    centres, levels = [], []
    for a, b in runs(free):
        for i in range(a, b - size + 1, size):
            centres.append(t[i : i + size].mean())
            levels.append(force[i : i + size].mean(axis=0))
    if len(centres) < MIN_BLOCKS:
        return None
    times, means = np.array(centres), np.array(levels)
    clock = times - times.mean()
    turning, carried = None, np.zeros_like(force)
    if recording.quaternion is not None:
        frames = matrices(recording.quaternion)
        turned = frames[np.clip(np.searchsorted(t, times), 0, len(t) - 1)]
        if turned.std(axis=0).max() > LEAST_TURN:
            turning = _turning(turned, clock, means, frames[0])
            carried = np.einsum("nij,j->ni", frames, turning.tool_n)
            means = means - np.einsum("bij,j->bi", turned, turning.tool_n)
    rate_fit = clock @ means / (clock @ clock)
    left = means - means.mean(axis=0) - np.outer(clock, rate_fit)
    noise = max(float(np.sqrt((left**2).sum() / (3 * (len(times) - 2)))), noise_n / np.sqrt(size))
    parts = all_but_one(len(times), STRETCHES)
    level_se, rate_se = _scatter(np.array([_line(times[p], means[p], times.mean()) for p in parts]))
    mass, mass_se = _mass(recording, force - carried, free, noise_n)
    return FreeAir(
        t=times,
        force=means,
        noise_n=noise,
        seconds=float(free.sum() / rate),
        bias_n=means.mean(axis=0),
        bias_se_n=max(noise / np.sqrt(len(times)), level_se),
        rate_n_per_s=rate_fit,
        rate_se_n_per_s=max(noise / np.sqrt(clock @ clock), rate_se),
        mass_kg=mass,
        mass_se_kg=mass_se,
        turning=turning,
    )


def _line(t: np.ndarray, values: np.ndarray, about: float) -> np.ndarray:
    """(2, 3) level at a time and slope of the straight line through values (b, 3)."""
    columns = np.column_stack([np.ones(len(t)), t - about])
    return np.linalg.lstsq(columns, values, rcond=None)[0]


def _scatter(lines: np.ndarray) -> tuple[float, float]:
    """Standard errors of level and slope, of the axis that scatters most; lines: (s, 2, 3)."""
    spread = np.sqrt(np.diag(jackknife_covariance(lines.reshape(len(lines), 6)))).reshape(2, 3).max(axis=1)
    return float(spread[0]), float(spread[1])


def matrices(quaternion: np.ndarray) -> np.ndarray:
    """(n, 3, 3) rotations, tool to device, of unit quaternions (n, 4) scalar first."""
    return Rotation.from_quat(quaternion, scalar_first=True).as_matrix()


def _turning(turned: np.ndarray, clock: np.ndarray, means: np.ndarray, first: np.ndarray) -> Turning:
    """Least squares of block means on a constant, a drift, and a vector that turns with the tool.

    turned: (b, 3, 3) tool to device at the blocks' centres; first: (3, 3) at the recording's start.
    """
    b = len(clock)
    eye = np.eye(3)
    columns = np.concatenate([np.tile(eye, (b, 1, 1)), clock[:, None, None] * eye, turned], axis=2).reshape(
        3 * b, 9
    )
    solution, *_ = np.linalg.lstsq(columns, means.reshape(-1), rcond=None)
    left = means.reshape(-1) - columns @ solution
    covariance = np.linalg.pinv(columns.T @ columns)
    spread = np.sqrt(left @ left / max(3 * b - 9, 1) * np.diag(covariance)[6:].max())
    return Turning(solution[6:], float(spread), first)


def _mass(
    recording: Recording, read: np.ndarray, free: np.ndarray, noise_n: float, width_s: float = 0.05
) -> tuple[float, float]:
    """Mass whose inertia the free-air force shows, kg, and its standard error: force = -m a over 50 ms
    fits."""
    width = max(5, round(width_s * recording.sample_rate_hz) | 1)
    half = width // 2
    inner = np.flatnonzero(np.convolve(free, np.ones(width), mode="same") > width - 0.5)[::width]
    inner = inner[(inner > half) & (inner < len(free) - half)]
    if len(inner) < 20:
        return 0.0, float("inf")
    hand = acceleration(recording.t, recording.position, width_s=width_s)[inner]
    force = read[inner[:, None] + np.arange(-half, half + 1)].mean(axis=1)
    hand = hand - hand.mean(axis=0)
    force = force - force.mean(axis=0)
    power = (hand**2).sum()
    if power <= 0:
        return 0.0, float("inf")
    mass = -float((force * hand).sum() / power)
    left = force + mass * hand
    return mass, float(np.sqrt((left**2).mean() / power))
