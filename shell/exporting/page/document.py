"""The page as one HTML file: template, styles and scripts beside this file, and the contents of one model.

The button "press it" of a report: it opens the page of the report's object, which the report carries.
"""

from __future__ import annotations

import base64
import gzip
import html
import io
import json
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.exporting.page.contents import ONE_D, contents, one_d_renderer, press_word
from palpate.exporting.subject import Subject
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent
from palpate.render.fem.renderer import FemRenderer
from palpate.render.press import Stroke, press
from palpate.render.scene import TouchScene, in_the_air
from palpate.show.colours import style_sheet
from palpate.show.scenery import AZIMUTH_DEG, ELEVATION_DEG, draw_touched
from palpate.words import kpa, mm, renderer_words, typed_word

if TYPE_CHECKING:
    from palpate.scenes.scene import Scene

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
    if not _at_hand(model):
        folder = html.escape(typed_word(model.path or "MODEL"))
        return (
            '<p class="press-it">Press it in a browser, by mouse, finger or keyboard: '
            f'<code class="command">palpate export {folder} --to page -o touch.html</code></p>'
        )
    page = gzip.compress(page_of(FemRenderer(model)).encode(), 9, mtime=0)
    return file("button.html").replace("{{page}}", base64.b64encode(page).decode()).rstrip("\n")


def _at_hand(model: Model) -> bool:
    return model.path is not None and any(model.path.glob("compliance-*.bin"))
