"""The interactive view of an object that every page shares: turn it, colour it, ask a place, see its press.

Drawn by three.js, whose script trimesh ships for its own notebook view, and by `view3d.js` beside this file;
everything is inside the page. Without scripts, or where a browser has no WebGL, the page's picture stays.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from palpate.show.object3d import AZIMUTH_DEG, ELEVATION_DEG, level_axes, spread_over
from palpate.show.quantities import ORDER
from palpate.show.view3d_parts import Colouring, Thing, Traces, floats, packed_curves, rounded, whole

_SHOWN_SHARE = (2.0, 98.0)
_STOPS = 24
_SHORT = 65_535
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
    head, rows = _rows(view)
    data = {
        "points": floats(1e3 * (thing.points - middle)),
        "wide": len(thing.points) > _SHORT,
        "triangles": whole(thing.triangles, "<u4" if len(thing.points) > _SHORT else "<u2"),
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
        "colourings": _scaled([_colouring(c, view) for c in view.known]),
        "table": {"head": head, "rows": rows},
    }
    return data | ({"curves": packed_curves(view.traces)} if view.traces else {})


def _colouring(colouring: Colouring, view: View) -> dict[str, Any]:
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
    stops = colormaps[quantity.colour_map](np.linspace(0.0, 1.0, _STOPS))
    return {
        "name": colouring.title,
        "unit": quantity.unit,
        "words": colouring.words,
        "stops": [to_hex(s) for s in stops],
        "limits": (quantity, low, high, every.min(), every.max()),
        "surface": None if values is None else floats(values * quantity.scale),
        "known": None if known is None else whole((255 * known).round(), "u1"),
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
    rows = []
    for i, place in enumerate(1e3 * view.places):
        row = [str(i + 1), ", ".join(f"{v:.0f}" for v in place.round() + 0.0)]
        rows.append(row + ["–" if not np.isfinite(v[i]) else f"{v[i]:.3g}" for _, v in shown])
    return head, rows


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
