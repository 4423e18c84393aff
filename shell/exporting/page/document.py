"""The page as one HTML file: template, styles and scripts beside this file, and the contents of one model.

The button "press it" of a report: it opens the page of the report's object, which the report carries.

What stands in a page of a model: geometry, tables, modes of the far field, measured presses; and
what its scripts are given.
"""

from __future__ import annotations

import base64
import gzip
import html
import io
import json
from collections.abc import Sequence
from functools import cache, lru_cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.devices.codecs import spacemouse
from palpate.exporting.page.tables import (
    PackedArrays,
    depths_of,
    first_depth,
    greatest_depth,
    modes_of,
    responses,
    straight_forces,
)
from palpate.exporting.subject import Subject
from palpate.mechanics.compliance.surface_compliance import SurfaceCompliance
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.errors import ModelError, OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.progress import Progress, silent
from palpate.render.base import Renderer
from palpate.render.fem.renderer import FemRenderer
from palpate.render.force_error import modulus_share, place_numbers, rendered_share
from palpate.render.press import Stroke, press
from palpate.render.registry import create
from palpate.render.scene import TouchScene, in_the_air
from palpate.show.colours import style_sheet
from palpate.show.light import lit
from palpate.show.scenery import AZIMUTH_DEG, ELEVATION_DEG, draw_touched
from palpate.words import kpa, mm, renderer_words, typed_word

if TYPE_CHECKING:
    from palpate.scenes.scene import Scene


ONE_D = "hunt-crossley"
ERROR = 0.003
"""Of the mean force at a depth, by which the modes of a table may be off."""
SHOWN_MODES, SHOWN_ERROR = 64, 0.01
"""Of the far field as it is drawn: most modes, and the share of the compliance that they may leave out."""
CURVE_POINTS = 48
_NO_SLIP = 1e9
_SIDEWAYS = 0.5
"""How far a press goes aside for each metre of depth when errors of sideways stiffness are weighed."""


def contents(renderer: FemRenderer, progress: Progress = silent) -> tuple[PackedArrays, dict[str, Any]]:
    """The arrays of a page, and what its scripts are given of the model."""
    model, arrays = renderer.model, renderer.contact.arrays
    depths = depths_of(greatest_depth(renderer))
    block = PackedArrays()
    block.between("vertices", arrays.vertices)
    block.around("normals", arrays.normals)
    seen = lit(arrays.vertices, arrays.triangles, arrays.free > 0)
    block.whole("seen_at", seen.at)
    block.whole("seen_triangles", seen.triangles)
    block.around("seen_normals", seen.normals)
    block.whole("free", arrays.free)
    progress("page: forces", 0.1)
    table = responses(renderer, depths)
    sizes = np.repeat(table.channels[:, :, :1].mean(axis=0), table.channels.shape[2], axis=1)
    sizes[:, 4:] /= _SIDEWAYS
    both = np.concatenate([table.channels, table.bend_channels])
    modes = modes_of(both.reshape(len(both), -1), sizes.ravel(), ERROR)
    # of a bend: what its middle differs by from the mean of its ends
    modes.weights[len(table.channels) :] -= modes.weights[table.bends].mean(axis=1)
    block.modes("response", modes)
    block.whole("bends", table.bends)
    progress("page: forces", 0.6)
    beside = one_d_renderer(model)
    if beside is not None:
        curves = straight_forces(beside, depths)
        block.modes("one_d", modes_of(curves, curves.mean(axis=0), ERROR))
    band = force_band(renderer, depths)
    block.modes("band", modes_of(band, band.mean(axis=0), 0.02))
    _far(block, renderer)
    presses = _measured(block, model.presses)
    progress("page: forces", 1.0)
    return block, {
        **about(renderer, depths),
        "one_d": None if beside is None else ONE_D,
        "presses": {**presses, "word": press_word(model)},
        "arrays": block.index,
    }


@lru_cache(maxsize=1)
def one_d_renderer(model: Model) -> Renderer | None:
    """The interpolated 1D model of the page, None where the model's presses hold no parameters of it."""
    if not len(model.presses):
        return None
    try:
        return create(ONE_D, model)
    except ModelError:
        return None


def press_word(model: Model) -> str:
    """What the model's presses are: measured, or virtual where nobody touched the object of a scene."""
    return "virtual" if model.untouched else "measured"


def about(renderer: FemRenderer, depths_m: np.ndarray) -> dict[str, Any]:
    """Numbers of the model, SI, device frame."""
    model = renderer.model
    low, high = model.material.young_modulus_ci95_pa
    friction = float(renderer.parameters.friction[0])
    return {
        "name": model.name,
        "young_modulus_pa": model.material.young_modulus_pa,
        "young_modulus_ci95_pa": [low, high] if np.isfinite([low, high]).all() else None,
        "poisson_ratio": model.material.poisson_ratio,
        "tip_radius_m": model.tool.tip_radius_m,
        "friction": friction if np.isfinite(friction) else _NO_SLIP,
        "support_point": model.support.point.tolist(),
        "support_normal": model.support.normal.tolist(),
        "depths_m": depths_m.tolist(),
        "first_depth_m": first_depth(model),
        "spacemouse": {
            "full_scale": spacemouse.FULL_SCALE,
            "products": [[vendor, each] for vendor, all_ in spacemouse.PRODUCTS.items() for each in all_],
            "reports": spacemouse_reports(),
        },
    }


def spacemouse_reports() -> list[dict[str, Any]]:
    """How a SpaceMouse's input reports are read, found out by asking the codec: for each report id and least
    length in bytes (without the id) what each value is: at (first byte), of (translation or rotation), axis,
    sign.
    """
    found = []
    for report, length in ((1, 12), (1, 6), (2, 6)):
        fields = []
        for at in range(0, length, 2):
            data = bytearray(1 + length)
            data[0] = report
            data[1 + at : 3 + at] = int(spacemouse.FULL_SCALE).to_bytes(2, "little")
            moved = spacemouse.decode(bytes(data), spacemouse.Deflection())
            for of, values in (("translation", moved.translation), ("rotation", moved.rotation)):
                fields += [
                    {"at": at, "of": of, "axis": axis, "sign": value}
                    for axis, value in enumerate(values)
                    if value
                ]
        found.append({"report": report, "bytes": length, "fields": fields})
    return found


def _far(block: PackedArrays, renderer: FemRenderer) -> None:
    """Modes by which a force moves the mesh's corners, U U^T / E, and how each vertex hangs on three of
    them."""
    compliance, contact = renderer.whole_compliance, renderer.contact
    number = np.full(len(renderer.model.mesh.points), len(compliance.nodes))
    number[compliance.nodes] = np.arange(len(compliance.nodes))
    modes = shown_modes(compliance)
    block.around("far", modes.reshape(-1, modes.shape[2]))
    block.whole("nodes", number[contact.nodes])
    block.between("node_weights", contact.node_weights)


def shown_modes(compliance: SurfaceCompliance) -> np.ndarray:
    """(t, 3, r) 1/m^0.5, unit modulus: the displacement of corner i for a force on corner j is nearly
    modes[i] @ modes[j].T."""
    t = len(compliance.nodes)
    if len(compliance.factor):
        wide = compliance.factor.reshape(3 * t, -1).astype(float)
        values, vectors = np.linalg.eigh(wide.T @ wide)
        vectors = wide @ vectors / np.sqrt(np.maximum(values, 1e-300))
    else:
        square = compliance.blocks.transpose(0, 2, 1, 3).reshape(3 * t, 3 * t).astype(float)
        values, vectors = np.linalg.eigh(0.5 * (square + square.T))
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    left_out = 1 - np.cumsum(values) / values.sum()
    count = min(int(np.searchsorted(-left_out, -SHOWN_ERROR)) + 1, SHOWN_MODES, len(values))
    return (vectors[:, :count] * np.sqrt(values[:count])).reshape(t, 3, count)


def _measured(block: PackedArrays, presses: Presses) -> dict[str, Any]:
    """The measured presses: where they met the surface and, where samples are kept, force along the normal
    over depth, on the way in and out."""
    block.floats("press_points", presses.point)
    block.floats("press_normals", presses.normal)
    starts, depths, forces = [0], [], []
    if presses.sampled:
        net = presses.net
        for p, part in enumerate(net.parts):
            inside = (net.t[part] >= net.onset_s[p]) & (net.t[part] <= net.end_s[p])
            depth, force = net.depth[part][inside], net.push[part][inside]
            some = _thinned(depth, force)
            depths.append(some[0])
            forces.append(some[1])
            starts.append(starts[-1] + len(some[0]))
    block.floats("press_depth", np.concatenate(depths) if depths else np.zeros(0))
    block.floats("press_force", np.concatenate(forces) if forces else np.zeros(0))
    return {"count": len(presses), "starts": starts if len(starts) > 1 else [0] * (len(presses) + 1)}


def _thinned(depth_m: np.ndarray, force_n: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means over runs of rows, CURVE_POINTS at most."""
    parts: Sequence[np.ndarray] = [
        rows
        for rows in np.array_split(np.arange(len(depth_m)), min(CURVE_POINTS, max(len(depth_m), 1)))
        if len(rows)
    ]
    means = [np.array([values[rows].mean() for rows in parts]) for values in (depth_m, force_n)]
    return means[0], means[1]


def force_band(renderer: FemRenderer, depth_m: np.ndarray) -> np.ndarray:
    """(v, k) 95 % half width of the force over the force, at the v vertices of the renderer's surface and
    depths (k,) m.

    The model's interval of its modulus and the law's own error (render.force_error), taken as independent.
    """
    radius = renderer.model.tool.tip_radius_m
    numbers = place_numbers(renderer, radius)[:, :, None]
    return np.hypot(modulus_share(renderer.model), rendered_share(renderer, depth_m / radius, numbers))


SCRIPTS = ("data", "surface", "press", "shape", "draw", "chart", "spacemouse", "tip", "page")
_ROWS = 12
_VIRTUAL = (
    " This object is a known shape of a known modulus that was not touched: its presses are virtual, "
    "computed "
    "by the same law."
)


def write(
    path: Path,
    subject: Subject,
    *,
    opens: bool = False,
    scene: Scene | None = None,
    progress: Progress = silent,
) -> tuple[str, ...]:
    """Write the page; what it cannot say. opens: on the subject's press, unless a link names another one.
    scene: whose title and task it bears."""
    renderer = FemRenderer(subject.model, progress=progress)
    first = [*subject.top.tolist(), subject.depth_m] if opens else None
    title, task = (None, "") if scene is None else (scene.title or None, scene.task)
    path.write_text(page_of(renderer, first, progress, title=title, task=task), encoding="utf-8")
    return (f"no {', no '.join(left_out(subject.model))}",)


def page_of(
    renderer: FemRenderer,
    opens: list[float] | None = None,
    progress: Progress = silent,
    *,
    title: str | None = None,
    task: str = "",
) -> str:
    """The whole page of a model's finite-element renderer. opens: x, y, z, depth, m, of a press that it opens
    on. title: the model's name unless given. task: what is to be done with it, in sentences."""
    block, about = contents(renderer, progress)
    model = renderer.model
    about["opens"] = opens
    about["view"] = [float(np.radians(AZIMUTH_DEG)), float(np.radians(ELEVATION_DEG))]
    table_title, table = _table(renderer)
    about["one_d_words"] = renderer_words(ONE_D)
    one_d = f'<li><i class="one-d"></i>{about["one_d_words"]}</li>'
    filled = {
        "name": html.escape(title or model.name),
        "summary": html.escape(task and f"{task} ") + _summary(model),
        "style": style_sheet() + file("page.css"),
        "picture": _picture(model),
        "felt": renderer_words("fem"),
        "one_d": one_d if about["one_d"] else "",
        "table_title": table_title,
        "table": table,
        "word": press_word(model),
        "words": _words(renderer),
        "left_out": html.escape("; ".join(left_out(model))),
        "about": json.dumps(about, separators=(",", ":"), allow_nan=False).replace("</", "<\\/"),
        "block": block.base64(),
        "scripts": "\n".join(file(f"{name}.js") for name in SCRIPTS),
    }
    page = file("page.html")
    for name, value in filled.items():
        page = page.replace("{{" + name + "}}", value)
    return page.rstrip("\n")


@cache
def file(name: str) -> str:
    """A part of the page, as it stands beside this module."""
    return files("palpate.exporting.page").joinpath(name).read_text(encoding="utf-8")


def left_out(model: Model) -> tuple[str, ...]:
    """What a page does not show of a model, in words."""
    memory = [name for name in model.effects if effect(name).law is not None]
    remembers = f" ({', '.join(memory)}: felt as at 10 mm/s on the way in)" if memory else ""
    return (
        "second tip",
        f"memory of how fast and how often one pressed{remembers}",
        "support next to the object",
        "depth beyond its tables",
    )


def _summary(model: Model) -> str:
    low, high = np.array(model.material.young_modulus_ci95_pa) / 1e3
    interval = f" ({low:.1f} to {high:.1f})" if np.isfinite([low, high]).all() else ""
    return (
        f"Soft object, {kpa(model.material.young_modulus_pa, '.1f')}{interval}, felt with a tip of "
        f"{mm(model.tool.tip_radius_m)} radius"
    )


def _words(renderer: FemRenderer) -> str:
    friction = float(renderer.parameters.friction[0])
    slides = f"it slides at a friction of {friction:.3g}" if np.isfinite(friction) else "it never slides"
    return (
        "Forces are read from tables that the program's own finite-element renderer made: straight and "
        "slanting presses at every vertex of the surface, at 10 mm/s. Between vertices and depths the page "
        f"interpolates; the tip sticks, and {slides}. The band holds the 95 % interval of the modulus and "
        "the error of the law. The shape that is drawn moves by the strongest modes of the compliance; "
        "the dent right under the tip is drawn so that it clears the ball."
        + (_VIRTUAL if press_word(renderer.model) == "virtual" else "")
    )


def _picture(model: Model) -> str:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.4, 4.8), layout="constrained")
    draw_touched(figure.subplots(), model)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100, transparent=True)
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def _table(renderer: FemRenderer) -> tuple[str, str]:
    """Title and rows: some of the model's own presses, as they were, by finite elements and in 1D."""
    model = renderer.model
    presses, beside = model.presses, one_d_renderer(model)
    chosen = np.unique(np.linspace(0, len(presses) - 1, min(len(presses), _ROWS)).round().astype(int))
    word = press_word(model)
    head = (
        "press",
        "",
        "depth [mm]",
        f"{word} [N]",
        f"{renderer_words('fem')} [N]",
        f"{renderer_words(ONE_D)} [N]",
        "at x, y, z [mm]",
    )
    rows = []
    scenes = [in_the_air(each) if each is not None else None for each in (renderer, beside)]
    for i in chosen:
        at, normal, depth = presses.point[i], presses.normal[i], float(presses.depth_m[i])
        forces = [_pressed(each, at, normal, depth) for each in scenes]
        place = ",".join(f"{v:.6f}" for v in at)
        cells = [str(i + 1), f'<button data-at="{place}">press it</button>', f"{1e3 * depth:.1f}"]
        cells += [_number(v) for v in (_peak(model, int(i)), *forces)]
        rows.append([*cells, ", ".join(f"{v:.0f}" for v in (1e3 * at).round() + 0.0)])
    if not rows:
        return "Measured presses: none", "<p>This model was not made from presses.</p>"
    top = "".join(f'<th scope="col">{text}</th>' for text in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>" for cells in rows)
    fewer = len(rows) < len(presses)
    title = f"{len(rows)} of {len(presses)} {word} presses, evenly chosen" if fewer else f"The {word} presses"
    return title, f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"


def _pressed(scene: TouchScene | None, at: np.ndarray, normal: np.ndarray, depth_m: float) -> float:
    """Normal force, N, of a straight press; NaN where there is no scene or it misses."""
    if scene is None:
        return float("nan")
    try:
        curve = press(scene, at, -normal, Stroke(depth_m, 0.01))
    except OptionError:
        return float("nan")
    return float(curve.force_at(depth_m) @ normal)


def _peak(model: Model, i: int) -> float:
    """Greatest measured force along the normal of a press, N; NaN where no samples are kept."""
    if not model.presses.sampled:
        return float("nan")
    push = model.presses.net.push[model.presses.parts[i]]
    return float(push.max()) if len(push) else float("nan")


def _number(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else "–"


def button(model: Model) -> str:
    """HTML of the button. Where the object's compliance is not kept in its folder yet, which takes a while to
    compute, the button says by which command the page is made instead."""
    if model.path is None or not any(model.path.glob("compliance-*.bin")):
        folder = html.escape(typed_word(model.path or "MODEL"))
        return (
            '<p class="press-it">Press it in a browser, by mouse, finger or keyboard: '
            f'<code class="command">palpate export {folder} --to page -o touch.html</code></p>'
        )
    page = gzip.compress(page_of(FemRenderer(model)).encode(), 9, mtime=0)
    return file("button.html").replace("{{page}}", base64.b64encode(page).decode()).rstrip("\n")
