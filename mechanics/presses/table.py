"""The one table of presses: what a recording says of every press, made once by reconstruction and kept in the
MODEL.

A frozen, ragged table: p presses, their n samples one after another. Everything that asks about a press reads
it or a view of it (net of free air, thinned, contact only, one site), and whatever reconstruction found out
about the recording (where the base was traced, where the tip was in the air, how late the force reads, how
noisy it is) stands in it. SI units, device frame, forces on the tool.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from palpate.mechanics.errors import ModelError
from palpate.mechanics.frames import local_frames
from palpate.mechanics.recording.segments import TimeSegment, delayed, within

FITS = ("k_kv", "b_kv", "k_hc", "b_hc", "r_hc", "k_v", "k_c", "r_c", "k_h", "e_pa")
"""What is fitted to each press: Kelvin-Voigt, eq. (1): k_kv N/m, b_kv N s/m; Hunt-Crossley, eq. (2): k_hc
N/m^r, b_hc N s/m^(r+1), r_hc; without damping k_v N/m, eq. (5), k_c N/m^r, r_c, eq. (6), and k_h N/m^r, eq.
(6) at the mean exponent; e_pa Pa, the modulus of this press alone, eq. (13). Equations: Goksel et al."""
MARGIN_S = 0.05
"""Contact samples reach this far beyond first and last touch: adhesion and delay show there."""
LEAD_S = 0.12
"""A press is over this long before the next one touches; paths that a memory reads start so much earlier."""
STEP_S = 0.01
"""The averaging for which the noise is measured."""
USUAL_NOISE_N = 0.012
LOADING, HOLDING, UNLOADING, OUTSIDE = 0, 1, 2, 3


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
    segments: tuple[TimeSegment, ...] = ()
    recording: str = ""
    quaternion: np.ndarray | None = None
    fits: Mapping[str, np.ndarray] = field(default_factory=dict)
    columns: Mapping[str, np.ndarray] = field(default_factory=dict)
    block: int = 1

    def __post_init__(self) -> None:
        for name in (*ROW_COLUMNS, *PRESS_COLUMNS):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _frozen(value, int if name in ("starts", "site") else float))
        p = len(self.starts) - 1
        fits = {n: self.fits.get(n, np.full(p, np.nan)) for n in FITS}
        object.__setattr__(self, "fits", MappingProxyType({n: _frozen(v, float) for n, v in fits.items()}))
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
        sizes = {n: len(getattr(self, n)) for n in PRESS_COLUMNS}
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

    @cached_property
    def parts(self) -> list[slice]:
        """The rows of each press."""
        return [slice(int(a), int(b)) for a, b in zip(self.starts[:-1], self.starts[1:], strict=True)]

    def rows(self, presses: Iterable[int]) -> np.ndarray:
        """Row numbers of these presses, in order."""
        parts = [np.arange(self.starts[i], self.starts[i + 1]) for i in presses]
        return np.concatenate(parts) if parts else np.zeros(0, dtype=int)

    def within(self, kind: str, t: np.ndarray) -> np.ndarray:
        """Bool for each time: whether it lies in a segment of that kind."""
        return within(self.segments, kind, t)

    def touching(self, t: np.ndarray, margin_s: float = MARGIN_S) -> np.ndarray:
        """Bool for each time: a contact sample, from first touch to loss of touch and `margin_s` around."""
        inside = np.zeros(len(t), dtype=bool)
        for onset, end in zip(self.onset_s, self.end_s, strict=True):
            inside |= (t > onset - margin_s) & (t < end + margin_s)
        return inside

    @cached_property
    def kinds(self) -> tuple[str, ...]:
        """(p,) the kind of segment that each press is: press, cycle or points."""
        named = {s.start_s: s.kind for s in self.segments}
        return tuple(named.get(float(t), "press") for t in self.onset_s)

    @property
    def quasi_static(self) -> bool:
        """Whether the rows are points without a time: their clock only numbers them."""
        return bool(len(self)) and all(kind == "points" for kind in self.kinds)

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
        return local_frames(self.normal)

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
        """(n,) m/s, of the depth; 0 of points without a time."""
        return np.zeros(len(self.t)) if self.quasi_static else self._in_time(self.depth)

    @cached_property
    def velocity(self) -> np.ndarray:
        """(n, 3) m/s of the tip, device frame."""
        return self._in_time(self.position)

    def _in_time(self, values: np.ndarray) -> np.ndarray:
        """Their change a second, press by press; 0 of presses of two rows and fewer."""
        out = np.zeros_like(values)
        for part in self.parts:
            if part.stop - part.start > 2:
                out[part] = np.gradient(values[part], self.t[part], axis=0)
        return out

    @cached_property
    def push(self) -> np.ndarray:
        """(n,) N, force on the tool along the outward normal."""
        return np.einsum("ni,ni->n", self.force, self.normal[self.press])

    @cached_property
    def phase(self) -> np.ndarray:
        """(n,) LOADING, HOLDING (within a tenth of the greatest depth), UNLOADING, or OUTSIDE the touch."""
        out = np.full(len(self.t), HOLDING)
        for p, part in enumerate(self.parts):
            depth, t, own = self.travel[part, 0], self.t[part], out[part]
            if not len(depth):
                continue
            deepest = depth.max()
            # a delayed hand may stay out of the surface throughout
            first, last = np.flatnonzero(depth >= deepest - 0.1 * abs(deepest))[[0, -1]]
            own[:first] = LOADING
            own[last + 1 :] = UNLOADING
            own[(t < self.onset_s[p]) | (t > self.end_s[p])] = OUTSIDE
        return out

    @cached_property
    def deepest(self) -> np.ndarray:
        """(p,) m, greatest depth below the surface."""
        return np.array([self.travel[part, 0].max() for part in self.parts])

    @cached_property
    def speed(self) -> np.ndarray:
        """(n,) m/s, rate of the depth below the surface, smoothed over five rows; 0 of points without a
        time."""
        out = np.zeros(len(self.t))
        for part in () if self.quasi_static else self.parts:
            smooth = np.convolve(np.pad(self.travel[part, 0], 2, mode="edge"), np.full(5, 0.2), mode="valid")
            out[part] = np.gradient(smooth, self.t[part])
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
    def force_rms_n(self) -> float:
        """N, rms of the force 3-vector over contact samples."""
        return float(np.sqrt((self.local_force[self.counted] ** 2).sum(axis=1).mean()))

    @property
    def lost_work(self) -> float:
        """Share of the work of pressing in, along the normal, that does not come back; median of presses."""
        from scipy.integrate import cumulative_trapezoid

        lost = []
        for part in self.parts:
            depth = self.travel[part, 0]
            work = cumulative_trapezoid(self.local_force[part, 0], depth, initial=0.0)
            if (spent := work[np.argmax(depth)]) > 0:
                lost.append(work[-1] / spent)
        return float(np.median(lost)) if lost else 0.0

    @property
    def thinned_away(self) -> float:
        """N^2, what thinning took off the mean square of the 3-vector."""
        return 3 * (self.noise.raw_n**2 - self.noise_n**2)

    # views

    @cached_property
    def net(self) -> Presses:
        """Forces less what is read in free air, at the time of the position (the delay undone)."""
        force = delayed(self.parts, self.t, self.force - self.free_air, -self.delay_s)
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
            self,
            **self._of_rows(rows),
            starts=np.concatenate([[0], np.cumsum(lengths)]),
            **{n: getattr(self, n)[chosen] for n in PRESS_COLUMNS if n != "site"},
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
        starts = np.concatenate([[0], np.cumsum(counts)])
        return dataclasses.replace(self, **self._of_rows(np.flatnonzero(rows)), starts=starts)

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

    def _of_rows(self, rows: np.ndarray) -> dict[str, Any]:
        """The row columns of some rows, by name."""
        columns = {n: getattr(self, n) for n in ROW_COLUMNS if n != "starts"}
        cut = {n: None if v is None else v[rows] for n, v in columns.items()}
        return cut | {"columns": {n: v[rows] for n, v in self.columns.items()}}

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


ROW_COLUMNS = ("starts", "t", "position", "force", "free_air", "quaternion")
PRESS_COLUMNS = (
    "onset_s", "peak_s", "end_s", "centre", "contact_normal", "onset_error_m", "point", "normal", "depth_m",
    "site",
)  # fmt: skip


def _frozen(value: Any, kind: type) -> np.ndarray:
    array: np.ndarray = np.ascontiguousarray(value, dtype=kind)
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array
