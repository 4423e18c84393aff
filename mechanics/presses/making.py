"""Tables of presses that no recording gave: of paths that were computed, of places alone, of nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.presses.repeats import sites_of
from palpate.mechanics.presses.table import STEP_S, USUAL_NOISE_N, Noise, Presses


@dataclass(frozen=True)
class PathErrors:
    """What is stated of made paths. onset_m: (p,) or one, m, standard error of first touch. noise_n: N an
    axis, white."""

    onset_m: np.ndarray | float = 0.0
    noise_n: float = USUAL_NOISE_N


def of_paths(
    starts: np.ndarray,
    position: np.ndarray,
    force: np.ndarray,
    centre: np.ndarray,
    normal: np.ndarray,
    *,
    tip_radius_m: float,
    sample_rate_hz: float,
    errors: PathErrors = PathErrors(),
) -> Presses:
    """A table of paths that nobody recorded: press i holds the rows starts[i] to starts[i + 1] of position
    (n, 3) m and force (n, 3) N on the tool, and touches where the tip's centre passes centre[i] (3,) m along
    -normal[i]. One second lies between two presses.
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
        onset_error_m=np.broadcast_to(np.asarray(errors.onset_m, float), p),
        point=point,
        normal=normal,
        depth_m=deepest,
        site=sites_of(point, normal),
        tip_radius_m=tip_radius_m,
        sample_rate_hz=sample_rate_hz,
        noise=Noise(errors.noise_n, errors.noise_n / np.sqrt(max(1, round(STEP_S * sample_rate_hz)))),
    )


def of_places(
    point: np.ndarray,
    normal: np.ndarray,
    tip_radius_m: float,
    *,
    depth_m: np.ndarray | float = np.nan,
    fits: Mapping[str, np.ndarray] | None = None,
) -> Presses:
    """A table without samples: surface points (p, 3) m, outward normals (p, 3), and what is known of them."""
    point, normal = np.atleast_2d(point).reshape(-1, 3), np.atleast_2d(normal).reshape(-1, 3)
    count = len(point)
    unknown = np.full(count, np.nan)
    fits = {} if fits is None else {n: np.broadcast_to(np.asarray(v, float), count) for n, v in fits.items()}
    return Presses(
        starts=np.zeros(count + 1),
        t=np.zeros(0),
        position=np.zeros((0, 3)),
        force=np.zeros((0, 3)),
        free_air=np.zeros((0, 3)),
        onset_s=unknown,
        peak_s=unknown,
        end_s=unknown,
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
