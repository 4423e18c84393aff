"""The interactive view of an object that every page shares: turn it, colour it, ask a place, see its press.

Drawn by three.js, whose script trimesh ships for its own notebook view, and by `view3d.js` beside this file;
everything is inside the page. Without scripts, or where a browser has no WebGL, the page's picture stays.

What a view in 3D is made of: a surface, its colourings, curves of presses; and how a page holds them.
"""

from __future__ import annotations

import base64
import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from palpate.show.light import lit
from palpate.show.quantities import ORDER, ShownQuantity
from palpate.show.scenery import AZIMUTH_DEG, ELEVATION_DEG, level_axes, spread_over

_SHOWN_SHARE = (2.0, 98.0)
_STOPS = 24
_SHORT, _ONE = 65_535, 32_767
_STANDING = 1e-3
"""Of the object's size: what is no higher above the support belongs to the foot."""
_THREE = re.compile(r'.*?Object\.defineProperty\(\w+,"__esModule",\{value:!0\}\)\}\)\);?', re.DOTALL)


@dataclass(frozen=True)
class View:
    """An object to be turned. places: (p, 3) m, where it was touched; selected: the press shown first; angles
    as in `object3d`, degrees; force: of the curves, first "into" the surface or "sideways"."""

    thing: Thing
    places: np.ndarray
    colourings: Sequence[Colouring]
    traces: Traces | None = None
    selected: int = 0
    azimuth_deg: float = AZIMUTH_DEG
    elevation_deg: float = ELEVATION_DEG
    force: str = "into"

    @property
    def known(self) -> list[Colouring]:
        """The colourings of which something is known."""
        return [c for c in self.colourings if _known(c)]

    def html(self, still: str) -> str:
        """The section; still: HTML of what is shown without scripts."""
        data = json.dumps(_data(self), separators=(",", ":"), allow_nan=False).replace("</", "<\\/")
        options = "".join(f"<option>{html.escape(c.title)}</option>" for c in self.known)
        live = _file("view3d.html").replace("<!-- options -->", options)
        if self.traces is None:
            live = re.sub("<!-- curve -->.*<!-- end of curve -->", "", live, flags=re.DOTALL)
        return (
            f'<section class="view3d" data-state="still"><div class="still">{still}</div>{live}{_table(self)}'
            f'<script type="application/json" class="data">{data}</script></section>'
        )


def _known(colouring: Colouring) -> bool:
    return any(v is not None and np.isfinite(v).any() for v in (colouring.surface, colouring.presses))


def _data(view: View) -> dict[str, Any]:
    thing = view.thing
    middle = 0.5 * (thing.points.min(axis=0) + thing.points.max(axis=0))
    up = thing.up / np.linalg.norm(thing.up)
    height = (thing.points - thing.support_point) @ up
    standing = height < _STANDING * np.linalg.norm(np.ptp(thing.points, axis=0))
    seen = lit(thing.points, thing.triangles, ~standing[thing.triangles].all(axis=1))
    wide = len(seen.at) > _SHORT
    reach = float(np.abs(thing.points - middle).max())
    head, rows = _rows(view)
    data = {
        "points": _shares((thing.points[seen.at] - middle) / reach),
        "reach": 1e3 * reach,
        "normals": _shares(seen.normals),
        "wide": wide,
        "triangles": whole(seen.triangles, "<u4" if wide else "<u2"),
        "places": floats(1e3 * (view.places - middle)),
        "middle": rounded(1e3 * middle),
        "up": rounded(up, 9),
        "aside": rounded(level_axes(up)[0], 9),
        # distances along up are counted from the middle in the page, which is its origin
        "floor": round(float(1e3 * (thing.support_point - middle) @ up), 3),
        "azimuth": view.azimuth_deg,
        "elevation": view.elevation_deg,
        "selected": int(view.selected),
        "force": view.force,
        "colourings": _scaled([_colouring(c, view, seen.at) for c in view.known]),
        "table": {"head": head, "rows": rows},
    }
    return data | ({"curves": packed_curves(view.traces)} if view.traces else {})


def _colouring(colouring: Colouring, view: View, at: np.ndarray) -> dict[str, Any]:
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    quantity, own, thing = colouring.quantity, colouring.presses, view.thing
    values, known = colouring.surface, None
    if values is None and own is not None and quantity is not ORDER:
        used = np.isfinite(own)
        values, known = spread_over(thing.points, view.places[used], own[used])
        values = np.where(thing.touchable, values, np.nan)
    every = np.concatenate([v[np.isfinite(v)] for v in (values, own) if v is not None]) * quantity.scale
    low, high = np.percentile(every, _SHOWN_SHARE) if values is not None else (every.min(), every.max())
    high = max(high, colouring.reach * quantity.scale)
    stops = colormaps[quantity.colour_map](np.linspace(0.0, 1.0, _STOPS))
    return {
        "name": colouring.title,
        "unit": quantity.unit,
        "words": colouring.words,
        "stops": [to_hex(s) for s in stops],
        "limits": (quantity, low, high, every.min(), every.max()),
        "surface": None if values is None else floats(values[at] * quantity.scale),
        "known": None if known is None else whole((255 * known[at]).round(), "u1"),
        "presses": None if own is None else floats(own * quantity.scale),
    }


def _scaled(colourings: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Limits of the colours: the same for all of one quantity, so that they can be compared."""
    all_limits = [c.pop("limits") for c in colourings]
    for c, (quantity, _, _, least, most) in zip(colourings, all_limits, strict=True):
        alike = [limits for limits in all_limits if limits[0] is quantity]
        low, high = quantity.limits(min(x[1] for x in alike), max(x[2] for x in alike))
        slack = 1e-6 * (abs(low) + abs(high))
        c |= {"low": float(low), "high": float(high)}
        c |= {"cut_low": bool(least < low - slack), "cut_high": bool(most > high + slack)}
    return colourings


def _rows(view: View) -> tuple[list[str], list[list[str]]]:
    """Head and rows, in words, of the presses: place, and what each colouring says of it."""
    shown = [(c, c.presses * c.quantity.scale) for c in view.known if c.presses is not None]
    shown = [(c, values) for c, values in shown if c.quantity is not ORDER]
    head = ["press", "at x, y, z [mm]"]
    head += [c.title + (f" [{c.quantity.unit}]" if c.quantity.unit else "") for c, _ in shown]
    columns = [_alike(values) for _, values in shown]
    rows = []
    for i, place in enumerate(1e3 * view.places):
        row = [str(i + 1), ", ".join(f"{v:.0f}" for v in place.round() + 0.0)]
        rows.append(row + [cells[i] for cells in columns])
    return head, rows


def _alike(values: np.ndarray) -> list[str]:
    """Numbers of a column, all with the decimals of its greatest at three digits."""
    most = np.nanmax(np.abs(values), initial=0.0, where=np.isfinite(values))
    decimals = max(0, 2 - int(np.floor(np.log10(most)))) if most > 0 else 0
    return [f"{v:.{decimals}f}" if np.isfinite(v) else "–" for v in values]


def _table(view: View) -> str:
    head, rows = _rows(view)
    top = "".join(f'<th scope="col">{html.escape(text)}</th>' for text in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return (
        f'<details class="presses"><summary>The {len(rows)} presses as a table</summary><div class="scroll" '
        f'tabindex="0"><table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div></details>'
    )


@cache
def scripts() -> str:
    """The scripts that make views live, as HTML; '' where trimesh brings no three.js that is known here."""
    three = _three()
    if not three:
        return ""
    return f"<script>{three}</script>\n<script>{_file('view3d.js')}</script>"


def _file(name: str) -> str:
    return files("palpate.show").joinpath(name).read_text(encoding="utf-8")


def _three() -> str:
    """three.js with its licence's words, out of the page that trimesh makes for notebooks."""
    import trimesh
    from trimesh.viewer.notebook import scene_to_html

    page = scene_to_html(trimesh.Scene(trimesh.primitives.Box()))
    script = re.search(r"<script>(.*?)</script>", page, re.DOTALL)
    found = _THREE.match(script[1]) if script else None
    return found[0] if found and "Three.js Authors" in found[0][:200] else ""


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
    touched. words: what the numbers are, if that is not plain. name: instead of the quantity's. reach: to
    which the colours go at least, as what is noise is no alarm."""

    quantity: ShownQuantity
    surface: np.ndarray | None = None
    presses: np.ndarray | None = None
    words: str = ""
    name: str = ""
    reach: float = 0.0

    @property
    def title(self) -> str:
        """Its name."""
        return self.name or self.quantity.name


@dataclass(frozen=True)
class Line:
    """A force along the presses, (n, 3) N on the tool in the local frame (outward normal, tangent, tangent),
    at each row (NaN: none).

    kind: a name of the table of colours (`show.colours`), or 'effect', which has none. shown: from
    the start. depth_m: (n,) where this line has depths of its own.
    """

    name: str
    force_n: np.ndarray
    kind: str = "fem"
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


def _shares(values: np.ndarray) -> str:
    """Of 1, either way, to 0.003 %: half as long as `floats`."""
    return whole((_ONE * values).round(), "<i2")


def rounded(values: np.ndarray, digits: int = 4) -> list[float]:
    return [round(float(v), digits) for v in values]
