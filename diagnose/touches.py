"""The data of a diagnosis: every press of a recording, thinned to 100 Hz, in the local frame of its site.

Thinning by block means keeps the noise white and turns the 30 um steps of a device's encoder into a fine
scale.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial.distance import cdist

from diagnose.leads import leads
from mechanics.errors import DiagnosisError
from mechanics.model import Model
from mechanics.recording import Recording
from mechanics.sites import tangents

MARGIN_S = 0.05
"""Contact samples reach this far beyond first and last touch (adhesion and delay show there)."""
LEAD_S = 0.12
"""The paths start this much earlier, so that delayed and memory-bearing readings have a past."""
SITE_RADIUS_M = 0.008
"""Presses closer than this count as one site (repeats)."""
STEP_S = 0.01
FALLBACK_NOISE_N = 0.012
LOADING, HOLDING, UNLOADING, OUTSIDE = 0, 1, 2, 3
PHASES = ("loading", "hold", "unloading", "outside")


@dataclass(frozen=True)
class Touches:
    """p presses at s sites, n thinned samples; local frame (normal, tangent, tangent), into the object
    positive.

    start: (p + 1,) rows of each press. t: (n,) s. y: (n, 3) m, travel of the tip's centre into the object
    since
    the surface. f: (n, 3) N on the tool (pressing: f[:, 0] > 0). counted: (n,) bool, contact samples.
    phase: (n,) LOADING, HOLDING, UNLOADING or OUTSIDE. noise_n: std of one thinned force component.
    point, normal: (p, 3) device frame. frame: (p, 3, 3) rows normal, tangent, tangent. site: (p,) its site.
    onset_s: (p,) first touch. repeat: (p,) how many earlier presses its site has had. samples_per_step: raw
    samples in a thinned one. raw_noise_n: std of one raw force component in free air. free: what free air
    tells.
    """

    start: np.ndarray
    t: np.ndarray
    y: np.ndarray
    f: np.ndarray
    counted: np.ndarray
    phase: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    frame: np.ndarray
    site: np.ndarray
    onset_s: np.ndarray
    repeat: np.ndarray
    noise_n: float
    raw_noise_n: float
    samples_per_step: int
    slowness: float = 1.0
    extra: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def presses(self) -> int:
        """How many presses."""
        return len(self.start) - 1

    @property
    def sites(self) -> int:
        """How many sites."""
        return int(self.site.max()) + 1

    @property
    def vector_noise_n(self) -> float:
        """N, rms of the noise of a raw force 3-vector."""
        return float(np.sqrt(3) * self.raw_noise_n)

    @property
    def thinned_away(self) -> float:
        """N^2, what thinning took off the mean square of the 3-vector."""
        return 3 * (self.raw_noise_n**2 - self.noise_n**2)

    @cached_property
    def site_point(self) -> np.ndarray:
        """(s, 3) m, device frame: the mean place of each site's presses."""
        return np.array([self.point[self.site == s].mean(axis=0) for s in range(self.sites)])

    @cached_property
    def press(self) -> np.ndarray:
        """(n,) the press of each sample."""
        return np.repeat(np.arange(self.presses), np.diff(self.start))

    @cached_property
    def depth(self) -> np.ndarray:
        """(p,) m, greatest depth of each press."""
        return np.array([self.y[a:b, 0].max() for a, b in zip(self.start[:-1], self.start[1:], strict=True)])

    @cached_property
    def speed(self) -> np.ndarray:
        """(n,) m/s, rate of depth, smoothed over 50 ms."""
        out = np.zeros(len(self.t))
        for a, b in zip(self.start[:-1], self.start[1:], strict=True):
            smooth = np.convolve(np.pad(self.y[a:b, 0], 2, mode="edge"), np.full(5, 0.2), mode="valid")
            out[a:b] = np.gradient(smooth, self.t[a:b])
        return out

    def subset(self, presses: np.ndarray) -> Touches:
        """Only some presses (indices), sites renumbered."""
        rows = np.concatenate([np.arange(self.start[p], self.start[p + 1]) for p in presses])
        lengths = np.diff(self.start)[presses]
        return Touches(
            start=np.concatenate([[0], np.cumsum(lengths)]),
            t=self.t[rows],
            y=self.y[rows],
            f=self.f[rows],
            counted=self.counted[rows],
            phase=self.phase[rows],
            point=self.point[presses],
            normal=self.normal[presses],
            frame=self.frame[presses],
            site=np.unique(self.site[presses], return_inverse=True)[1],
            onset_s=self.onset_s[presses],
            repeat=self.repeat[presses],
            noise_n=self.noise_n,
            raw_noise_n=self.raw_noise_n,
            samples_per_step=self.samples_per_step,
            slowness=self.slowness,
            extra={k: v[rows] for k, v in self.extra.items()},
        )


def touches_of(recording: Recording, model: Model, *, step_s: float = STEP_S) -> Touches:
    """Cut, thin and turn the presses of a recording; places and normals are those of the model's palpations.

    Raises DiagnosisError with fewer than 6 palpations or 4 sites: nothing can be held out.
    """
    palpations = model.palpations
    if len(palpations) < 6:
        raise DiagnosisError(
            f"the model has {len(palpations)} palpations; a diagnosis holds sites out and needs at least 6"
        )
    t = recording.t
    per_step = max(1, round(step_s * recording.sample_rate_hz))
    measured = free_air_noise(recording, model, per_step)
    raw_noise = measured.raw_n
    onsets = np.array([p.t_onset for p in palpations])
    order = np.argsort(onsets)
    palpations = [palpations[i] for i in order]
    onsets = onsets[order]
    parts, points, normals, frames = [], [], [], []
    kept: list[float] = []
    for i, palpation in enumerate(palpations):
        normal = np.array(palpation.normal)
        normal = normal / np.linalg.norm(normal)
        frame = np.stack([normal, *tangents(normal)])
        point = np.array(palpation.point)
        limit = onsets[i + 1] - LEAD_S if i + 1 < len(palpations) else t[-1]
        end = _loss_of_touch(recording, palpation.t_onset, palpation.t_peak, limit, normal, raw_noise)
        if end - palpation.t_onset < 0.08:
            continue
        first = np.searchsorted(t, palpation.t_onset - LEAD_S)
        last = np.searchsorted(t, min(end + LEAD_S, limit))
        count = (last - first) // per_step
        if count < 12:
            continue
        block = slice(first, first + count * per_step)

        def mean(values: np.ndarray, block: slice = block, count: int = count) -> np.ndarray:
            return values[block].reshape(count, per_step, *values.shape[1:]).mean(axis=1)

        time = mean(t)
        centre = point + recording.tip_radius_m * normal
        y = -(mean(recording.position) - centre) @ frame.T
        f = mean(recording.force_on_tool) @ frame.T
        counted = (time > palpation.t_onset - MARGIN_S) & (time < end + MARGIN_S)
        extra = {}
        if recording.quaternion is not None:
            extra["quaternion"] = mean(recording.quaternion)
        extra["position"] = mean(recording.position)
        extra["lead"] = leads(t[block], recording.position[block]).reshape(count, per_step, 3).mean(axis=1)
        parts.append((time, y, f, counted, _phases(time, y[:, 0], palpation.t_onset, end), extra))
        points.append(point)
        normals.append(normal)
        frames.append(frame)
        kept.append(palpation.t_onset)
    if len(parts) < 6:
        raise DiagnosisError(f"only {len(parts)} palpations last 0.1 s or more; a diagnosis needs at least 6")
    point = np.array(points)
    site = _sites(point, np.array(normals))
    if site.max() < 3:
        raise DiagnosisError(
            f"the palpations are at {site.max() + 1} places only; a diagnosis needs 4 or more"
        )
    repeat = np.array([int((site[:i] == site[i]).sum()) for i in range(len(site))])
    return Touches(
        start=np.concatenate([[0], np.cumsum([len(p[0]) for p in parts])]),
        t=np.concatenate([p[0] for p in parts]),
        y=np.concatenate([p[1] for p in parts]),
        f=np.concatenate([p[2] for p in parts]),
        counted=np.concatenate([p[3] for p in parts]),
        phase=np.concatenate([p[4] for p in parts]),
        point=point,
        normal=np.array(normals),
        frame=np.array(frames),
        site=site,
        onset_s=np.array(kept),
        repeat=repeat,
        noise_n=measured.thinned_n,
        slowness=measured.slowness,
        raw_noise_n=raw_noise,
        samples_per_step=per_step,
        extra={k: np.concatenate([p[5][k] for p in parts]) for k in parts[0][5]},
    )


def free_air(recording: Recording, model: Model) -> np.ndarray:
    """(n,) bool: phase-II samples well away from any touch (0.15 s from every press, force within the
    noise)."""
    t = recording.t
    free = np.ones(len(t), dtype=bool)
    begin = recording.boundary_phase[1] + 0.5 if recording.boundary_phase else 0.0
    free &= t > begin
    limits = [p.t_onset for p in model.palpations] + [t[-1]]
    for palpation in model.palpations:
        limit = min([x for x in limits if x > palpation.t_peak], default=t[-1])
        end = _loss_of_touch(
            recording, palpation.t_onset, palpation.t_peak, limit, np.array(palpation.normal), None
        )
        free &= (t < palpation.t_onset - 0.15) | (t > end + 0.15)
    return free


@dataclass(frozen=True)
class Noise:
    """Of one force component in free air, bias and drift taken off. raw_n: N, std of a sample. thinned_n: N,
    std of
    the mean over a thinned step. slowness: how much more a 0.1 s mean scatters (variance) than white noise
    would."""

    raw_n: float
    thinned_n: float
    slowness: float


def free_air_noise(recording: Recording, model: Model, per_step: int) -> Noise:
    """Measure the noise in free air; the stated (or a usual) value, white, where there is too little of
    it."""
    free = free_air(recording, model)
    stated = recording.force_noise_std_n or FALLBACK_NOISE_N
    if free.sum() < 200 * max(per_step, 1):
        return Noise(stated, stated / np.sqrt(per_step), 1.0)
    force = recording.force_on_tool
    steps = np.diff(force, axis=0)[free[1:] & free[:-1]]
    white = max(_robust_std(steps) / np.sqrt(2), 1e-4)
    line = np.polyfit(recording.t[free], force[free], 1)
    left = force - (recording.t[:, None] * line[0] + line[1])

    def of_means(size: int) -> float:
        edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(int)))
        means = [
            left[k : k + size].mean(axis=0)
            for a, b in zip(edges[::2], edges[1::2], strict=True)
            for k in range(a, b - size + 1, size)
        ]
        return _robust_std(np.array(means)) if len(means) > 20 else white / np.sqrt(size)

    thinned = max(of_means(per_step), white / np.sqrt(per_step))
    slow = of_means(10 * per_step) ** 2 * 10 / thinned**2
    # a hand that accelerates a heavy tool is no noise: what exceeds these is left for the diagnosis to find
    thinned = min(thinned, 2.2 * white / np.sqrt(per_step))
    raw = np.sqrt(white**2 * (1 - 1 / per_step) + thinned**2)
    return Noise(float(raw), float(thinned), float(np.clip(slow, 1.0, 10.0)))


def _robust_std(values: np.ndarray) -> float:
    return float(1.4826 * np.median(np.abs(values - np.median(values, axis=0))))


def _loss_of_touch(recording, onset, peak, limit, normal, noise) -> float:
    """The time at which a press's normal force is back within the noise of its free-air level."""
    t = recording.t
    begin, stop = np.searchsorted(t, [peak, limit])
    stop = max(stop, min(begin + 50, len(t)))
    force = recording.force_on_tool[begin:stop] @ normal
    if len(force) < 30:
        return float(t[min(stop, len(t) - 1)])
    smooth = np.convolve(force, np.full(15, 1 / 15), mode="same")
    before = slice(max(np.searchsorted(t, onset) - 150, 0), max(np.searchsorted(t, onset) - 30, 1))
    level = float(np.median(recording.force_on_tool[before] @ normal))
    threshold = level + max(0.02 * (smooth.max() - level), 3 * (noise or FALLBACK_NOISE_N) / np.sqrt(15))
    below = np.flatnonzero(smooth < threshold)
    return float(t[begin + below[0]]) if len(below) else float(t[stop - 1])


def _phases(t: np.ndarray, depth: np.ndarray, onset: float, end: float) -> np.ndarray:
    deepest = depth.max()
    near = depth >= deepest - 0.1 * abs(deepest)  # a delayed hand may stay out of the surface throughout
    first, last = np.flatnonzero(near)[[0, -1]]
    phase = np.full(len(t), HOLDING)
    phase[:first] = LOADING
    phase[last + 1 :] = UNLOADING
    phase[(t < onset) | (t > end)] = OUTSIDE
    return phase


def _sites(point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Presses within SITE_RADIUS_M on the same face are one site (single linkage, in order of time)."""
    close = (cdist(point, point) < SITE_RADIUS_M) & (normal @ normal.T > 0.7)
    label = np.arange(len(point))
    for i in range(len(point)):
        for j in np.flatnonzero(close[i, :i]):
            label[label == label[i]] = label[j]
    return np.unique(label, return_inverse=True)[1]
