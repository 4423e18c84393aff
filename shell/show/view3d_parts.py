"""What a view in 3D is made of: a surface, its colourings, curves of presses; and how a page holds them."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.show.quantities import Quantity

SAMPLES, FEWEST, MOST = 20_000, 30, 160
"""Points of all curves together, and of one curve at least and at most."""


@dataclass(frozen=True)
class Thing:
    """A surface to be turned: points (v, 3) m, triangles (k, 3) outward, touchable (v,) bool; the support's
    plane by a point (3,) m and its outward normal (3,)."""

    points: np.ndarray
    triangles: np.ndarray
    touchable: np.ndarray
    support_point: np.ndarray
    up: np.ndarray


@dataclass(frozen=True)
class Colouring:
    """What the object is coloured by, SI: surface (v,) a value at each point of the thing, NaN where none is
    known; presses (p,) one a press. Of presses alone the surface takes what is near, and fades where nobody
    touched. words: what the numbers are, if that is not plain. name: instead of the quantity's."""

    quantity: Quantity
    surface: np.ndarray | None = None
    presses: np.ndarray | None = None
    words: str = ""
    name: str = ""

    @property
    def title(self) -> str:
        """Its name."""
        return self.name or self.quantity.name


@dataclass(frozen=True)
class Line:
    """A force along the presses, (n, 3) N on the tool in the local frame (outward normal, tangent, tangent),
    at each row (NaN: none).

    kind: 'measured', 'rendered', 'found' (with what was found) or 'effect'. shown: from the start. depth_m:
    (n,) where this line has depths of its own.
    """

    name: str
    force_n: np.ndarray
    kind: str = "rendered"
    shown: bool = True
    depth_m: np.ndarray | None = None


@dataclass(frozen=True)
class Traces:
    """Curves of the presses: starts (p + 1,) first row of each; depth_m, time_s (n,) since first touch."""

    starts: np.ndarray
    depth_m: np.ndarray
    time_s: np.ndarray
    lines: Sequence[Line]


def packed_curves(traces: Traces) -> dict[str, Any]:
    lengths = np.diff(traces.starts)
    most = int(np.clip(SAMPLES // max(len(lengths), 1), FEWEST, MOST))
    kept = [
        first + _kept_rows(traces.depth_m[first : first + count], most)
        for first, count in zip(traces.starts, lengths, strict=False)
    ]
    chosen = np.concatenate(kept) if kept else np.zeros(0, dtype=int)
    along = _main_direction(traces)
    return {
        "starts": whole(np.cumsum([0, *map(len, kept)])),
        "depth": floats(1e3 * traces.depth_m[chosen]),
        "time": floats(traces.time_s[chosen]),
        "lines": [
            {
                "name": line.name,
                "kind": line.kind,
                "shown": line.shown,
                "into": floats(line.force_n[chosen, 0]),
                "sideways": floats((line.force_n[chosen, 1:] * along[chosen]).sum(axis=1)),
                "depth": None if line.depth_m is None else floats(1e3 * line.depth_m[chosen]),
            }
            for line in traces.lines
        ],
    }


def _kept_rows(depth_m: np.ndarray, most: int) -> np.ndarray:
    """Rows of a press, `most` at most: half spread over its time, half over the way that the tip goes."""
    count = len(depth_m)
    if count <= most:
        return np.arange(count)
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(depth_m)))])
    along = np.arange(count) / (count - 1) + way / max(float(way[-1]), 1e-12)
    return np.unique(
        np.interp(np.linspace(0.0, along[-1], most), along, np.arange(count)).round().astype(int)
    )


def _main_direction(traces: Traces) -> np.ndarray:
    """(n, 2) unit: where the first line's force points sideways in each press, for all its rows."""
    sideways = traces.lines[0].force_n[:, 1:]
    weighted = sideways * np.linalg.norm(sideways, axis=1, keepdims=True)
    parts = zip(traces.starts[:-1], traces.starts[1:], strict=True)
    total = np.array([np.nansum(weighted[a:b], axis=0) for a, b in parts]).reshape(-1, 2)
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-12)
    return np.repeat(total, np.diff(traces.starts), axis=0)


def floats(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode()


def whole(values: np.ndarray, kind: str = "<u4") -> str:
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def rounded(values: np.ndarray, digits: int = 4) -> list[float]:
    return [round(float(v), digits) for v in values]
