"""The one table of presses: what a recording says of every press, made once by reconstruction and kept in the
MODEL.

A frozen, ragged table: p presses, their n samples one after another. Everything that asks about a press reads
it or a view of it (net of free air, thinned, contact only, one site), and whatever reconstruction found out
about the recording (where the base was traced, where the tip was in the air, how late the force reads, how
noisy it is) stands in it. SI units, device frame, forces on the tool.
"""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree
from scipy.spatial.distance import cdist

from mechanics.errors import CacheError, ModelError
from mechanics.files import atomic_file
from mechanics.recording import Recording
from mechanics.store import read_arrays, write_arrays

KINDS = ("trace", "press", "free", "rigid", "retrace")
"""Kinds of segments: the base's outline, a press, free air, presses on something rigid, the outline once
more."""
FITS = ("k_kv", "b_kv", "k_hc", "b_hc", "r_hc", "k_v", "k_c", "r_c", "k_h", "e_pa")
"""What is fitted to each press: Kelvin-Voigt, eq. (1): k_kv N/m, b_kv N s/m; Hunt-Crossley, eq. (2): k_hc
N/m^r, b_hc N s/m^(r+1), r_hc; without damping k_v N/m, eq. (5), k_c N/m^r, r_c, eq. (6), and k_h N/m^r, eq.
(6) at the mean exponent; e_pa Pa, the modulus of this press alone, eq. (13). Equations: Goksel et al."""
SITE_M = 0.008
"""Presses further than this from one another are never repeats at one site."""
MARGIN_S = 0.05
"""Contact samples reach this far beyond first and last touch: adhesion and delay show there."""
LEAD_S = 0.12
"""A press is over this long before the next one touches; paths that a memory reads start so much earlier."""
AROUND_S = 0.3
"""Samples are kept this long before first and after last touch."""
CLEAR_S = 0.15
"""Free air keeps this far from any touch."""
SETTLED_S = 0.5
"""Free air begins this long after the base was traced."""
STEP_S = 0.01
"""The averaging for which the noise is measured."""
USUAL_NOISE_N = 0.012
LOADING, HOLDING, UNLOADING, OUTSIDE = 0, 1, 2, 3
_SAME_FACE = 0.7
_REPEAT_M = 0.001
_TOUCHING_M = 1e-9
_SMOOTH_S = 0.015
_LET_GO = 0.02
_FORMAT = "presses 1"


@dataclass(frozen=True)
class Segment:
    """A stretch of the recording: its kind, one of KINDS, and when it lasts, s."""

    kind: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class Noise:
    """Of one force component in free air, bias and drift taken off.

    raw_n: N, standard deviation of a sample. step_n: N, of the mean over STEP_S. variance_inflation: how much
    more (variance) the mean over ten steps scatters than white noise would.
    """

    raw_n: float = USUAL_NOISE_N
    step_n: float = USUAL_NOISE_N / np.sqrt(10)
    variance_inflation: float = 1.0


@dataclass(frozen=True)
class Presses:
    """p presses in order of time with n samples; arrays are read-only.

    starts: (p + 1,) first row of each press. Rows: t (n,) s; position (n, 3) m, the tip's centre; force (n,
    3) N as read; free_air (n, 3) N, what is read at that time in the air; quaternion (n, 4) scalar first,
    tool to device, or None; columns: further ones by name, (n, ...).
    Presses: onset_s, peak_s, end_s (p,) s: first touch, greatest force, loss of touch. centre (p, 3) m, the
    tip's centre at first touch; contact_normal (p, 3), outward, from the force; onset_error_m (p,), standard
    error of the first touch along it. point, normal (p, 3): of the object's surface at first touch, outward.
    depth_m: (p,) greatest travel along -normal. site: (p,) number of the place. fits: (p,) each, FITS.
    The recording: tip_radius_m; sample_rate_hz; noise; delay_s: by how much the force reads late (free_air is
    as late), delay_error_s its standard error; segments; recording, the key of its samples
    (Recording.content). block: raw samples in a row.
    """

    starts: np.ndarray
    t: np.ndarray
    position: np.ndarray
    force: np.ndarray
    free_air: np.ndarray
    onset_s: np.ndarray
    peak_s: np.ndarray
    end_s: np.ndarray
    centre: np.ndarray
    contact_normal: np.ndarray
    onset_error_m: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    depth_m: np.ndarray
    site: np.ndarray
    tip_radius_m: float
    sample_rate_hz: float = 1000.0
    noise: Noise = field(default_factory=Noise)
    delay_s: float = 0.0
    delay_error_s: float = 0.0
    segments: tuple[Segment, ...] = ()
    recording: str = ""
    quaternion: np.ndarray | None = None
    fits: Mapping[str, np.ndarray] = field(default_factory=dict)
    columns: Mapping[str, np.ndarray] = field(default_factory=dict)
    block: int = 1

    def __post_init__(self) -> None:
        for name in (*_ROWS, *_PRESS):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _frozen(value, int if name in ("starts", "site") else float))
        p = len(self.starts) - 1
        fits = {n: self.fits.get(n, np.full(p, np.nan)) for n in FITS}
        object.__setattr__(self, "fits", MappingProxyType({n: _frozen(v, float) for n, v in fits.items()}))
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
        sizes = {n: len(getattr(self, n)) for n in _PRESS}
        if set(sizes.values()) != {p} or self.starts[-1] != len(self.t) or self.normal.shape != (p, 3):
            raise ModelError(f"a table of {p} presses has columns of other lengths: {sizes}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled by its fields and built anew: a mapping proxy cannot be, and arrays come back writable."""
        values = (getattr(self, f.name) for f in dataclasses.fields(self))
        return Presses, tuple(dict(v) if isinstance(v, MappingProxyType) else v for v in values)

    def __len__(self) -> int:
        return len(self.starts) - 1

    # what is there

    @property
    def sampled(self) -> bool:
        """Whether the samples are there (a table made from places alone has none)."""
        return len(self.t) > 0

    @property
    def sites(self) -> int:
        """How many sites."""
        return int(self.site.max()) + 1 if len(self) else 0

    @cached_property
    def site_point(self) -> np.ndarray:
        """(s, 3) m: the mean place of each site's presses."""
        return np.array([self.point[self.site == s].mean(axis=0) for s in range(self.sites)])

    @cached_property
    def repeat(self) -> np.ndarray:
        """(p,) how many earlier presses its site has had."""
        return np.array([int((self.site[:i] == s).sum()) for i, s in enumerate(self.site)], dtype=int)

    @cached_property
    def press(self) -> np.ndarray:
        """(n,) the press of each row."""
        return np.repeat(np.arange(len(self)), np.diff(self.starts))

    def rows(self, presses: Iterable[int]) -> np.ndarray:
        """Row numbers of these presses, in order."""
        parts = [np.arange(self.starts[i], self.starts[i + 1]) for i in presses]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=int)

    def within(self, kind: str, t: np.ndarray) -> np.ndarray:
        """Bool for each time: whether it lies in a segment of that kind."""
        inside = np.zeros(len(t), dtype=bool)
        for segment in self.segments:
            if segment.kind == kind:
                inside |= (t >= segment.start_s) & (t <= segment.end_s)
        return inside

    def touching(self, t: np.ndarray, margin_s: float = MARGIN_S) -> np.ndarray:
        """Bool for each time: a contact sample, from first touch to loss of touch and `margin_s` around."""
        inside = np.zeros(len(t), dtype=bool)
        for onset, end in zip(self.onset_s, self.end_s, strict=True):
            inside |= (t > onset - margin_s) & (t < end + margin_s)
        return inside

    # the rows, seen from the device and from the place that was touched

    @cached_property
    def counted(self) -> np.ndarray:
        """(n,) bool: contact samples of their own press."""
        return (self.t > self.onset_s[self.press] - MARGIN_S) & (self.t < self.end_s[self.press] + MARGIN_S)

    @cached_property
    def displacement(self) -> np.ndarray:
        """(n, 3) m, travel of the tip's centre since first touch, device frame."""
        return self.position - self.centre[self.press]

    @cached_property
    def frame(self) -> np.ndarray:
        """(p, 3, 3) rows normal, tangent, tangent."""
        from mechanics.sites import tangents

        return np.array([np.stack([n, *tangents(n)]) for n in self.normal]).reshape(-1, 3, 3)

    @cached_property
    def travel(self) -> np.ndarray:
        """(n, 3) m, how far the tip's centre has gone into the object since it met the surface, local frame:
        travel[:, 0] is the depth along -normal."""
        met = (self.point + self.tip_radius_m * self.normal)[self.press]
        return -np.einsum("nij,nj->ni", self.frame[self.press], self.position - met)

    @cached_property
    def local_force(self) -> np.ndarray:
        """(n, 3) N on the tool, local frame: pressing gives local_force[:, 0] > 0."""
        return np.einsum("nij,nj->ni", self.frame[self.press], self.force)

    @cached_property
    def depth(self) -> np.ndarray:
        """(n,) m, travel along -normal since first touch."""
        return -np.einsum("ni,ni->n", self.displacement, self.normal[self.press])

    @cached_property
    def rate(self) -> np.ndarray:
        """(n,) m/s, of the depth."""
        out = np.zeros(len(self.t))
        for a, b in zip(self.starts[:-1], self.starts[1:], strict=True):
            if b - a > 2:
                out[a:b] = np.gradient(self.depth[a:b], self.t[a:b])
        return out

    @cached_property
    def push(self) -> np.ndarray:
        """(n,) N, force on the tool along the outward normal."""
        return np.einsum("ni,ni->n", self.force, self.normal[self.press])

    @cached_property
    def phase(self) -> np.ndarray:
        """(n,) LOADING, HOLDING (within a tenth of the greatest depth), UNLOADING, or OUTSIDE the touch."""
        out = np.full(len(self.t), HOLDING)
        for p, (a, b) in enumerate(zip(self.starts[:-1], self.starts[1:], strict=True)):
            depth, t = self.travel[a:b, 0], self.t[a:b]
            if not len(depth):
                continue
            deepest = depth.max()
            # a delayed hand may stay out of the surface throughout
            first, last = np.flatnonzero(depth >= deepest - 0.1 * abs(deepest))[[0, -1]]
            out[a : a + first] = LOADING
            out[a + last + 1 : b] = UNLOADING
            out[a:b][(t < self.onset_s[p]) | (t > self.end_s[p])] = OUTSIDE
        return out

    @cached_property
    def deepest(self) -> np.ndarray:
        """(p,) m, greatest depth below the surface."""
        return np.array(
            [self.travel[a:b, 0].max() for a, b in zip(self.starts[:-1], self.starts[1:], strict=True)]
        )

    @cached_property
    def speed(self) -> np.ndarray:
        """(n,) m/s, rate of the depth below the surface, smoothed over five rows."""
        out = np.zeros(len(self.t))
        for a, b in zip(self.starts[:-1], self.starts[1:], strict=True):
            smooth = np.convolve(np.pad(self.travel[a:b, 0], 2, mode="edge"), np.full(5, 0.2), mode="valid")
            out[a:b] = np.gradient(smooth, self.t[a:b])
        return out

    # noise

    @property
    def noise_n(self) -> float:
        """N, of one force component of a row."""
        step = max(1, round(STEP_S * self.sample_rate_hz))
        return self.noise.step_n if self.block == step else self.noise.raw_n / float(np.sqrt(self.block))

    @property
    def vector_noise_n(self) -> float:
        """N, rms of the noise of a raw force 3-vector."""
        return float(np.sqrt(3) * self.noise.raw_n)

    @property
    def thinned_away(self) -> float:
        """N^2, what thinning took off the mean square of the 3-vector."""
        return 3 * (self.noise.raw_n**2 - self.noise_n**2)

    # views

    @cached_property
    def net(self) -> Presses:
        """Forces less what is read in free air, at the time of the position (the delay undone)."""
        force = self.force - self.free_air
        if self.delay_s:
            force = force.copy()
            for a, b in zip(self.starts[:-1], self.starts[1:], strict=True):
                at, own = self.t[a:b] + self.delay_s, force[a:b].copy()
                force[a:b] = np.stack([np.interp(at, self.t[a:b], c) for c in own.T], axis=1)
        return dataclasses.replace(
            self, force=force, free_air=np.zeros_like(force), delay_s=0.0, delay_error_s=0.0
        )

    def of(self, presses: np.ndarray) -> Presses:
        """Only these presses (numbers or bool), sites numbered anew."""
        chosen = np.arange(len(self))[np.asarray(presses)]
        rows = self.rows(chosen)
        lengths = np.diff(self.starts)[chosen]
        site = np.unique(self.site[chosen], return_inverse=True)[1]
        return dataclasses.replace(
            self._of_rows(rows),
            starts=np.concatenate([[0], np.cumsum(lengths)]),
            **{n: getattr(self, n)[chosen] for n in _PRESS if n != "site"},
            site=site,
            fits={n: v[chosen] for n, v in self.fits.items()},
        )

    def window(self, lead_s: float, tail_s: float) -> Presses:
        """Only rows from `lead_s` before first touch to `tail_s` after its loss, never into a neighbour's
        touch."""
        onset = self.onset_s[self.press]
        last = np.concatenate([[-np.inf], self.end_s[:-1]])[self.press] if len(self) else onset
        return self.where(
            (self.t >= np.maximum(onset - lead_s, last)) & (self.t <= self.end_s[self.press] + tail_s)
        )

    def where(self, rows: np.ndarray) -> Presses:
        """Only some rows, (n,) bool; every press stays, if need be without rows."""
        counts = np.bincount(self.press[rows], minlength=len(self))
        return dataclasses.replace(
            self._of_rows(np.flatnonzero(rows)), starts=np.concatenate([[0], np.cumsum(counts)])
        )

    def thinned(self, step_s: float) -> Presses:
        """Means over whole steps, from each press's first row on: keeps white noise white, and turns the
        steps of an encoder into a fine scale. A press shorter than a step keeps one row."""
        size = max(1, round(step_s * self.sample_rate_hz))
        spans = []
        for a, b in zip(self.starts[:-1], self.starts[1:], strict=True):
            own = min(size, b - a)
            spans.append((a, own, (b - a) // own if own else 0))

        def mean(values: np.ndarray) -> np.ndarray:
            parts = [
                values[a : a + own * count].reshape(count, own, *values.shape[1:]).mean(axis=1)
                for a, own, count in spans
                if count
            ]
            return np.concatenate(parts) if parts else values[:0]

        return dataclasses.replace(
            self,
            starts=np.concatenate([[0], np.cumsum([count for *_, count in spans])]),
            t=mean(self.t),
            position=mean(self.position),
            force=mean(self.force),
            free_air=mean(self.free_air),
            quaternion=None if self.quaternion is None else mean(self.quaternion),
            columns={n: mean(v) for n, v in self.columns.items()},
            block=size,
        )

    def _of_rows(self, rows: np.ndarray) -> Presses:
        """The row columns cut, while `starts` is put right by the caller (checked there)."""
        copy = object.__new__(Presses)
        copy.__dict__.update({f.name: getattr(self, f.name) for f in dataclasses.fields(self)})
        for n in _ROWS:
            value = getattr(self, n)
            if n != "starts" and value is not None:
                object.__setattr__(copy, n, value[rows])
        object.__setattr__(copy, "columns", {n: v[rows] for n, v in self.columns.items()})
        return copy

    def on_surface(self, point: np.ndarray, normal: np.ndarray) -> Presses:
        """The table with places (p, 3) m and outward unit normals (p, 3) of a surface; depths along them.

        Sites stay as they are.
        """
        changed = dataclasses.replace(self, point=point, normal=normal)
        return dataclasses.replace(changed, depth_m=changed.greatest_depth())

    def greatest_depth(self) -> np.ndarray:
        """(p,) m, from first touch to loss of touch; what was known before where there are no samples."""
        out = np.array(self.depth_m)
        inside = (self.t >= self.onset_s[self.press]) & (self.t < self.end_s[self.press])
        for p in np.unique(self.press[inside]):
            out[p] = self.depth[inside & (self.press == p)].max()
        return out

    def with_fits(self, **fits: np.ndarray) -> Presses:
        """The table with further fitted columns, (p,) each, of FITS."""
        return dataclasses.replace(self, fits={**self.fits, **fits})


_ROWS = ("starts", "t", "position", "force", "free_air", "quaternion")
_PRESS = (
    "onset_s", "peak_s", "end_s", "centre", "contact_normal", "onset_error_m", "point", "normal", "depth_m",
    "site",
)  # fmt: skip


def _frozen(value: Any, kind: type) -> np.ndarray:
    array: np.ndarray = np.ascontiguousarray(value, dtype=kind)
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array


def sites_of(point: np.ndarray, normal: np.ndarray, reach_m: float = SITE_M) -> np.ndarray:
    """(k,) the site of each press, numbered in order of time: chains of presses (k, 3) m that lie nearer to
    one another than the cut, with outward normals (k, 3) that look the same way.

    The cut is the data's own: repeats scatter by a little and sites stand apart, so among the lengths of the
    shortest tree that joins the presses it lies in the widest gap (by ratio) between _REPEAT_M and `reach_m`.
    """
    if not len(point):
        return np.zeros(0, dtype=int)
    gap = cdist(point, point)
    gap[normal @ normal.T <= _SAME_FACE] = np.inf
    joined = np.where(np.isfinite(gap), np.maximum(gap, _TOUCHING_M), 0.0)
    edges = np.sort(minimum_spanning_tree(joined).data)
    steps = np.concatenate([[_REPEAT_M], edges[(edges > _REPEAT_M) & (edges < reach_m)], [reach_m]])
    ratios = steps[1:] / steps[:-1]
    cut_m = steps[:-1][ratios >= ratios.max() - 1e-12][-1]
    label = connected_components(gap <= max(cut_m, _TOUCHING_M), directed=False)[1]
    first = np.unique(label, return_index=True)[1]
    order = np.empty(len(first), dtype=int)
    order[np.argsort(first)] = np.arange(len(first))
    return order[label]


def loss_of_touch(
    t: np.ndarray,
    push: np.ndarray,
    rate_hz: float,
    *,
    onset_s: float,
    peak_s: float,
    limit_s: float,
    noise_n: float,
) -> float:
    """The time, s, at which a press's force is back at what it was in the air.

    t: (n,) s at about rate_hz; push: (n,) N, as read along the outward normal, of noise_n a sample. limit_s:
    no later than this. Back: the mean over 15 ms within 2 % of the greatest, or three times its own noise, of
    the median from 150 to 30 ms before first touch.
    """
    size = max(1, round(_SMOOTH_S * rate_hz))
    begin, stop = np.searchsorted(t, [peak_s, limit_s])
    stop = max(stop, min(begin + round(0.05 * rate_hz), len(t)))
    after = push[begin:stop]
    if len(after) < 2 * size:
        return float(t[min(stop, len(t) - 1)])
    smooth = np.convolve(after, np.full(size, 1 / size), mode="same")
    first = int(np.searchsorted(t, onset_s))
    before = push[max(first - round(0.15 * rate_hz), 0) : max(first - round(0.03 * rate_hz), 1)]
    level = float(np.median(before))
    least = level + max(_LET_GO * (smooth.max() - level), 3 * noise_n / np.sqrt(size))
    below = np.flatnonzero(smooth < least)
    return float(t[begin + below[0]]) if len(below) else float(t[stop - 1])


def free_segments(
    t: np.ndarray, onset_s: np.ndarray, end_s: np.ndarray, begin_s: float
) -> tuple[Segment, ...]:
    """Stretches of free air between the touches (onset_s, end_s), CLEAR_S away from each, after begin_s."""
    free = t > begin_s
    for onset, end in zip(onset_s, end_s, strict=True):
        free &= (t < onset - CLEAR_S) | (t > end + CLEAR_S)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], free.astype(np.int8), [0]])))
    pairs = zip(edges[::2], edges[1::2] - 1, strict=True)
    return tuple(Segment("free", float(t[a]), float(t[b])) for a, b in pairs if b > a)


def measured_noise(recording: Recording, free: np.ndarray) -> Noise:
    """The noise in free air, (n,) bool; the stated (or a usual) value, white, where there is too little."""
    per_step = max(1, round(STEP_S * recording.sample_rate_hz))
    stated = recording.force_noise_std_n or USUAL_NOISE_N
    if free.sum() < 200 * per_step:
        return Noise(stated, stated / np.sqrt(per_step), 1.0)
    force = recording.force_on_tool
    steps = np.diff(force, axis=0)[free[1:] & free[:-1]]
    white = max(_robust_std(steps) / np.sqrt(2), 1e-4)
    line = np.polyfit(recording.t[free], force[free], 1)
    left = force - (recording.t[:, None] * line[0] + line[1])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(int)))

    def of_means(size: int) -> float:
        means = [
            left[k : k + size].mean(axis=0)
            for a, b in zip(edges[::2], edges[1::2], strict=True)
            for k in range(a, b - size + 1, size)
        ]
        return _robust_std(np.array(means)) if len(means) > 20 else white / np.sqrt(size)

    step = max(of_means(per_step), white / np.sqrt(per_step))
    inflation = of_means(10 * per_step) ** 2 * 10 / step**2
    # a hand that accelerates a heavy tool is no noise: what exceeds these is left for the diagnosis to find
    step = min(step, 2.2 * white / np.sqrt(per_step))
    raw = np.sqrt(white**2 * (1 - 1 / per_step) + step**2)
    return Noise(float(raw), float(step), float(np.clip(inflation, 1.0, 10.0)))


def _robust_std(values: np.ndarray) -> float:
    return float(1.4826 * np.median(np.abs(values - np.median(values, axis=0))))


def cut(
    recording: Recording,
    *,
    onset_s: np.ndarray,
    peak_s: np.ndarray,
    centre: np.ndarray,
    normal: np.ndarray,
    onset_error_m: np.ndarray | None = None,
    free_air: np.ndarray | None = None,
    trace_s: tuple[float, float] | None = None,
    others_s: Iterable[tuple[float, float]] = (),
    noise_n: float | None = None,
    delay_s: float = 0.0,
    delay_error_s: float = 0.0,
    site_m: float = SITE_M,
) -> Presses:
    """The table of a recording whose presses were found: first touches onset_s (p,) and greatest forces
    peak_s (p,) s, in order, the tip's centre (p, 3) m and the outward normal (p, 3) at first touch.

    onset_error_m: (p,) standard errors. free_air: (n, 3) N, as late as the force. trace_s: when the base was
    traced. others_s: further contacts, which are neither presses nor free air. noise_n: N, of a sample; None:
    the stated or a usual one.
    """
    t, count = recording.t, len(onset_s)
    normal = np.asarray(normal, dtype=float).reshape(-1, 3)
    centre = np.asarray(centre, dtype=float).reshape(-1, 3)
    free = np.zeros_like(recording.force_on_tool) if free_air is None else free_air
    noise = noise_n or recording.force_noise_std_n or USUAL_NOISE_N
    limits = np.append(np.asarray(onset_s)[1:] - LEAD_S, t[-1])
    onset, end = np.asarray(onset_s, dtype=float), np.empty(count)
    for i in range(count):
        near = slice(*np.searchsorted(t, [onset[i] - 0.2, max(limits[i], peak_s[i]) + 0.2]))
        end[i] = loss_of_touch(
            t[near], recording.force_on_tool[near] @ normal[i], recording.sample_rate_hz,
            onset_s=onset[i], peak_s=peak_s[i], limit_s=limits[i], noise_n=noise,
        )  # fmt: skip
    pieces = []
    for i in range(count):
        stop = min(end[i] + AROUND_S, onset[i + 1] if i + 1 < count else np.inf)
        pieces.append(np.arange(*np.searchsorted(t, [onset[i] - AROUND_S, stop])))
    rows = np.concatenate(pieces) if pieces else np.zeros(0, dtype=int)
    touches = np.array([*zip(onset, end, strict=True), *others_s]).reshape(-1, 2)
    begin = -np.inf if trace_s is None else trace_s[1] + SETTLED_S
    air = free_segments(t, touches[:, 0], touches[:, 1], begin)
    segments = [] if trace_s is None else [Segment("trace", *map(float, trace_s))]
    segments += [Segment("press", float(a), float(b)) for a, b in zip(onset, end, strict=True)]
    point = centre - recording.tip_radius_m * normal
    table = Presses(
        starts=np.concatenate([[0], np.cumsum([len(piece) for piece in pieces])]),
        t=t[rows],
        position=recording.position[rows],
        force=recording.force_on_tool[rows],
        free_air=free[rows],
        quaternion=None if recording.quaternion is None else recording.quaternion[rows],
        onset_s=onset,
        peak_s=peak_s,
        end_s=end,
        centre=centre,
        contact_normal=normal,
        onset_error_m=np.zeros(count) if onset_error_m is None else onset_error_m,
        point=point,
        normal=normal,
        depth_m=np.zeros(count),
        site=sites_of(point, normal, site_m),
        tip_radius_m=recording.tip_radius_m,
        sample_rate_hz=recording.sample_rate_hz,
        delay_s=delay_s,
        delay_error_s=delay_error_s,
        segments=(*segments, *air),
        recording=recording.content,
    )
    quiet = table.within("free", t)
    return dataclasses.replace(table, depth_m=table.greatest_depth(), noise=measured_noise(recording, quiet))


def of_paths(
    starts: np.ndarray,
    position: np.ndarray,
    force: np.ndarray,
    centre: np.ndarray,
    normal: np.ndarray,
    *,
    tip_radius_m: float,
    sample_rate_hz: float,
    onset_error_m: np.ndarray | float = 0.0,
    noise_n: float = USUAL_NOISE_N,
) -> Presses:
    """A table of paths that nobody recorded: press i holds the rows starts[i] to starts[i + 1] of position
    (n, 3) m and force (n, 3) N on the tool, and touches where the tip's centre passes centre[i] (3,) m along
    -normal[i]. One second lies between two presses; the forces' noise (an axis, white) is noise_n.
    """
    p, lengths = len(starts) - 1, np.diff(starts)
    press = np.repeat(np.arange(p), lengths)
    row = np.arange(len(position)) - np.asarray(starts)[press]
    begin = np.concatenate([[0.0], np.cumsum(lengths / sample_rate_hz + 1.0)[:-1]])
    t = begin[press] + row / sample_rate_hz
    depth = -np.einsum("ni,ni->n", position - centre[press], normal[press])
    onset, peak, end, deepest = (np.empty(p) for _ in range(4))
    for i in range(p):
        rows = slice(starts[i], starts[i + 1])
        inside = np.flatnonzero(depth[rows] > 0)
        first, last = (inside[0], inside[-1]) if len(inside) else (0, 0)
        top = int(np.argmax(depth[rows]))
        onset[i], peak[i], end[i] = t[rows][first], t[rows][top], t[rows][last] + 1 / sample_rate_hz
        deepest[i] = depth[rows][top]
    point = centre - tip_radius_m * normal
    return Presses(
        starts=starts,
        t=t,
        position=position,
        force=force,
        free_air=np.zeros_like(force),
        onset_s=onset,
        peak_s=peak,
        end_s=end,
        centre=centre,
        contact_normal=normal,
        onset_error_m=np.broadcast_to(np.asarray(onset_error_m, float), p),
        point=point,
        normal=normal,
        depth_m=deepest,
        site=sites_of(point, normal),
        tip_radius_m=tip_radius_m,
        sample_rate_hz=sample_rate_hz,
        noise=Noise(noise_n, noise_n / np.sqrt(max(1, round(STEP_S * sample_rate_hz)))),
    )


def of_places(
    point: np.ndarray,
    normal: np.ndarray,
    tip_radius_m: float,
    *,
    depth_m: np.ndarray | float = np.nan,
    onset_s: np.ndarray | None = None,
    peak_s: np.ndarray | None = None,
    fits: Mapping[str, np.ndarray] | None = None,
) -> Presses:
    """A table without samples: surface points (p, 3) m, outward normals (p, 3), and what is known of them."""
    point, normal = np.atleast_2d(point).reshape(-1, 3), np.atleast_2d(normal).reshape(-1, 3)
    count = len(point)
    unknown = np.full(count, np.nan)
    fits = {} if fits is None else {n: np.broadcast_to(np.asarray(v, float), count) for n, v in fits.items()}
    peak = unknown if peak_s is None else peak_s
    return Presses(
        starts=np.zeros(count + 1),
        t=np.zeros(0),
        position=np.zeros((0, 3)),
        force=np.zeros((0, 3)),
        free_air=np.zeros((0, 3)),
        onset_s=unknown if onset_s is None else onset_s,
        peak_s=peak,
        end_s=peak,
        centre=point + tip_radius_m * normal,
        contact_normal=normal,
        onset_error_m=np.zeros(count),
        point=point,
        normal=normal,
        depth_m=np.broadcast_to(np.asarray(depth_m, float), count),
        site=sites_of(np.nan_to_num(point), np.nan_to_num(normal)),
        tip_radius_m=tip_radius_m,
        fits=fits,
    )


def no_presses(tip_radius_m: float) -> Presses:
    """The table of an object that nobody pressed."""
    return of_places(np.zeros((0, 3)), np.zeros((0, 3)), tip_radius_m)


# files

CSV_COLUMNS = ("t_onset", "t_peak", "x", "y", "z", "nx", "ny", "nz", "depth", *FITS)


def write_csv(path: Path | str, presses: Presses) -> None:
    """Write `palpations.csv`: a row a press, the contract's columns, SI units, device frame."""
    table = np.column_stack(
        [presses.onset_s, presses.peak_s, presses.point, presses.normal, presses.depth_m]
        + [presses.fits[n] for n in FITS]
    )
    with atomic_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(CSV_COLUMNS)
        writer.writerows([repr(float(v)) for v in row] for row in table)


def read_csv(path: Path | str, tip_radius_m: float) -> Presses:
    """The table that `palpations.csv` holds, without samples; raises ModelError where a column is missing or
    a value is no number."""
    try:
        with open(path, newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
    except OSError as error:
        raise ModelError(f"'{path}' cannot be read: {error.strerror}") from error
    missing = [c for c in CSV_COLUMNS if rows and c not in rows[0]]
    if missing:
        raise ModelError(f"'{path}' lacks the columns {', '.join(missing)}")
    try:
        table = np.array([[float(row[c]) for c in CSV_COLUMNS] for row in rows]).reshape(-1, len(CSV_COLUMNS))
    except (TypeError, ValueError) as error:
        raise ModelError(f"'{path}' has a value that is no number: {error}") from error
    return of_places(
        table[:, 2:5], table[:, 5:8], tip_radius_m, depth_m=table[:, 8], onset_s=table[:, 0],
        peak_s=table[:, 1], fits=dict(zip(FITS, table[:, 9:].T, strict=True)),
    )  # fmt: skip


_NUMBERS = ("tip_radius_m", "sample_rate_hz", "delay_s", "delay_error_s", "block")


def write_presses(path: Path, presses: Presses) -> None:
    """Write the table as it stands, samples and all (views with further columns lose those)."""
    arrays = {n: getattr(presses, n) for n in (*_ROWS, *_PRESS) if getattr(presses, n) is not None}
    arrays |= {f"fit {n}": v for n, v in presses.fits.items()}
    arrays["numbers"] = np.array([float(getattr(presses, n)) for n in _NUMBERS])
    arrays["noise"] = np.array(dataclasses.astuple(presses.noise))
    arrays["segments"] = np.array(
        [[KINDS.index(s.kind), s.start_s, s.end_s] for s in presses.segments], dtype=float
    ).reshape(-1, 3)
    arrays["recording"] = np.frombuffer(presses.recording.encode(), dtype=np.uint8)
    write_arrays(path, _FORMAT, arrays)


def read_presses(path: Path) -> Presses:
    """Read what `write_presses` wrote; raises ModelError where the file is damaged."""
    try:
        arrays = read_arrays(path, _FORMAT)
        named: dict[str, Any] = {n: np.array(arrays[n]) for n in (*_ROWS, *_PRESS) if n in arrays}
        named |= zip(_NUMBERS, arrays["numbers"].tolist(), strict=True)
        named["block"] = int(named["block"])
        return Presses(
            **named,
            fits={n: np.array(arrays[f"fit {n}"]) for n in FITS},
            noise=Noise(*arrays["noise"].tolist()),
            segments=tuple(Segment(KINDS[int(k)], a, b) for k, a, b in arrays["segments"].tolist()),
            recording=bytes(arrays["recording"]).decode(),
        )
    except (CacheError, KeyError, ValueError) as error:
        raise ModelError(f"'{path}' is damaged ({error}): reconstruct the model again") from error
