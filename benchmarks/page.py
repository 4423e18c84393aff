"""A page that can be pressed against `palpate press`: the same presses in a browser and by the renderer.

Of every object the presses are drawn over its surface (seeded): half with the model's own friction, half
with one on which a tip slides; half straight in, half aslant by up to 60 degrees; from 0.5 mm to as deep as
the page goes. Left out are presses that miss or graze the object, and those in which the tip meets the
support, which a page has not. Beside them: every place of the model's own presses along its stated normal,
the file's size, first paint, and frames a second with everything drawn anew, on a desktop and a phone-sized
view under touch emulation. Beside other work of the machine they say little by themselves, so an empty page's
frames in the same minute stand beside them. Needs chromium (or google-chrome) on the PATH.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.evidence import Figure, rates
from benchmarks.timing import table
from palpate.exporting.page.document import page_of
from palpate.exporting.page.tables import greatest_depth
from palpate.mechanics.errors import OptionError
from palpate.mechanics.frames import local_frames
from palpate.operations.load import load
from palpate.output import progress_bar
from palpate.render.fem.renderer import FemRenderer
from palpate.render.press import Stroke, press
from palpate.render.scene import in_the_air
from tests.shell.show.browser import Tab, a_tab, browser_found

OBJECTS = ("silicone-1", "silicone-2", "silicone-3", "bean", "nodule")
SHARE, AT_LEAST_N = 0.02, 0.005
STEEPEST_DEG, SHALLOWEST_M, SPEED_M_PER_S = 60.0, 5e-4, 0.01
VIEWS = {"desktop, 1280 x 800": (1280, 800), "phone under touch emulation, 390 x 844": (390, 844)}
_SECONDS, _TIMES = 2.0, 3
_EMPTY = """<!doctype html><script>
let frames = 0;
requestAnimationFrame(function each() { frames += 1; requestAnimationFrame(each); });
const counted = async (seconds) => {
  const [first, start] = [frames, performance.now()];
  await new Promise((done) => setTimeout(done, 1e3 * seconds));
  return 1e3 * (frames - first) / (performance.now() - start);
};
</script>"""
"""A page that draws nothing, and says how often a browser would have shown it anew."""
_PAINTED = "performance.getEntriesByName('first-contentful-paint')"
_AT_ONCE = 25


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which objects, how many presses."""
    parser.add_argument(
        "objects",
        nargs="*",
        default=OBJECTS,
        metavar="MODEL",
        help="folders or scenes (default: the paper's three samples, a kidney, a dome with a nodule)",
    )
    parser.add_argument("--presses", type=int, default=500, help="drawn presses an object (default: 500)")
    parser.add_argument("--friction", type=float, default=0.2, help="of the half that slides (default: 0.2)")
    parser.add_argument("--seed", type=int, default=0, help="of the drawn presses (default: 0)")


@dataclass(frozen=True)
class Asked:
    """One press: at (3,) m, way (3,), depth m; force (3,) N by the renderer; kind: straight, aslant or
    own, at a place of the model's presses."""

    at: np.ndarray
    way: np.ndarray
    depth_m: float
    force: np.ndarray
    kind: str


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure; print a table; return the figures."""
    if browser_found() is None:
        raise OptionError("palpate bench page needs chromium or google-chrome on the PATH")
    found: dict[str, Any] = {}
    progress = progress_bar("pages")
    with tempfile.TemporaryDirectory() as folder, a_tab(Path(folder) / "profile") as tab:
        for k, name in enumerate(arguments.objects):
            found[Path(name).name] = _measured(name, arguments, tab, Path(folder))
            progress("pages", (k + 1) / len(arguments.objects))
    progress.close()
    rows = []
    for name, of in found.items():
        for kind, misses in of["misses"].items():
            if len(misses):
                relative = 100 * np.array(of["relative"][kind])
                share = 100 * np.mean(np.array(misses) <= 1)
                numbers = (np.median(relative), np.quantile(relative, 0.95), relative.max())
                rows.append([name, kind, str(len(misses)), *(f"{v:.2f}" for v in numbers), f"{share:.1f}"])
    print(table(["object", "presses", "count", "median %", "95 % %", "most %", "within %"], rows))
    for name, of in found.items():
        print(f"{name}: {of['bytes'] / 1e6:.2f} MB")
        for view, seen in of["views"].items():
            low, high = seen.spread
            print(
                f"  {view}: {seen.rate:.0f} frames a second ({low:.0f} to {high:.0f}; an empty page "
                f"{seen.empty:.0f}), {seen.cost_ms:.0f} ms of processor time each; first paint "
                f"{seen.paint_ms:.0f} ms, to be pressed {seen.ready_ms:.0f} ms"
            )
    return {"objects": found, "figures": _figures(found)}


def _measured(name: str, arguments: argparse.Namespace, tab: Tab, folder: Path) -> dict[str, Any]:
    own = FemRenderer(load(name))
    rng = np.random.default_rng(arguments.seed)
    misses: dict[str, list[float]] = {"straight": [], "aslant": [], "own": []}
    relative: dict[str, list[float]] = {kind: [] for kind in misses}
    of: dict[str, Any] = {"misses": misses, "relative": relative}
    half = arguments.presses // 2
    page = folder / "touch.html"
    page.write_text(page_of(own), encoding="utf-8")
    of["bytes"] = page.stat().st_size
    tab.open(page, *VIEWS["desktop, 1280 x 800"])
    tab.wait("window.palpate !== undefined")
    # its tables stick: of friction the page has one number
    slippery = own.with_friction(arguments.friction)
    for renderer, count in ((own, half), (slippery, arguments.presses - half)):
        if renderer is slippery:
            tab.evaluate(f"palpate.page.presser.about.friction = {arguments.friction}")
        asked = drawn(renderer, count, rng)
        answers = [np.array(force) for force in _answers(tab, asked)]
        if renderer is own:
            places = own_places(own)
            asked += places
            answers += [np.array(force) for force in _answers(tab, places, straight=True)]
        for each, force in zip(asked, answers, strict=True):
            off, size = float(np.linalg.norm(force - each.force)), float(np.linalg.norm(each.force))
            misses[each.kind].append(off / (SHARE * size + AT_LEAST_N))
            relative[each.kind].append(off / size)
    of["views"] = {view: looked_at(tab, page, *size) for view, size in VIEWS.items()}
    return of


@dataclass(frozen=True)
class Seen:
    """Frames a second with everything drawn anew under a press, several times, and of an empty page; ms of
    processor time of one; ms from the page's start to its first paint, and until it can be pressed."""

    rates: tuple[float, ...]
    empty: float
    cost_ms: float
    paint_ms: float
    ready_ms: float

    @property
    def rate(self) -> float:
        """The median, 1/s."""
        return float(np.median(self.rates))

    @property
    def spread(self) -> tuple[float, float]:
        """Least and greatest, 1/s."""
        return min(self.rates), max(self.rates)


def looked_at(tab: Tab, page: Path, width: int, height: int) -> Seen:
    """Measure one view; one as narrow as a phone's by a finger's browser."""
    empty = page.with_name("empty.html")
    empty.write_text(_EMPTY, encoding="utf-8")
    tab.call("Emulation.setTouchEmulationEnabled", enabled=width < 500, maxTouchPoints=2)
    try:
        tab.open(empty, width, height)
        most = float(tab.evaluate(f"counted({_SECONDS})"))
        tab.open(page, width, height)
        tab.wait("window.palpate !== undefined")
        ready = float(tab.evaluate("palpate.ready_ms"))
        tab.wait(f"{_PAINTED}.length > 0")
        paint = float(tab.evaluate(f"{_PAINTED}[0].startTime"))
        tab.evaluate(
            "palpate.page.pressAt([...palpate.page.surface.at(palpate.page.topPlace()).point], 3e-3)"
        )
        tab.evaluate(f"palpate.frames({_SECONDS})")  # the picture finds the sharpness that it can hold
        spent, drawn_before = _processor_s(), tab.evaluate("palpate.page.frames")
        rates = tuple(float(tab.evaluate(f"palpate.frames({_SECONDS})")) for _ in range(_TIMES))
        count = tab.evaluate("palpate.page.frames") - drawn_before
        return Seen(rates, most, 1e3 * (_processor_s() - spent) / max(count, 1), paint, ready)
    finally:
        tab.call("Emulation.setTouchEmulationEnabled", enabled=False)


def _processor_s() -> float:
    """Processor time of the browser, all of its processes."""
    total = 0.0
    for child in psutil.Process().children(recursive=True):
        with contextlib.suppress(psutil.Error):
            times = child.cpu_times()
            total += times.user + times.system
    return total


def drawn(renderer: FemRenderer, count: int, rng: np.random.Generator) -> list[Asked]:
    """Presses drawn over the touchable surface by area, with the renderer's answers."""
    arrays, model = renderer.contact.arrays, renderer.model
    triangles = arrays.triangles[arrays.free > 0]
    p = arrays.vertices[triangles]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    radius, deepest = model.tool.tip_radius_m, greatest_depth(renderer)
    found: list[Asked] = []
    while len(found) < count:
        weights, corners = (
            rng.dirichlet(np.ones(3)),
            triangles[rng.choice(len(triangles), p=area / area.sum())],
        )
        normal = weights @ arrays.normals[corners]
        frame = local_frames(normal[None] / np.linalg.norm(normal))[0]
        straight = len(found) % 2 == 0
        tilt = 0.0 if straight else np.radians(rng.uniform(0.0, STEEPEST_DEG))
        turn = rng.uniform(0.0, 2 * np.pi)
        way = np.array([-np.cos(tilt), np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn)]) @ frame
        at, depth = weights @ arrays.vertices[corners], float(rng.uniform(SHALLOWEST_M, deepest))
        try:
            curve = press(in_the_air(renderer), at, way, Stroke(depth, SPEED_M_PER_S))
        except OptionError:
            continue
        if model.support.height(curve.position[: curve.deepest + 1]).min() < radius:
            continue
        found.append(Asked(at, way, depth, curve.force_at(depth), "straight" if straight else "aslant"))
    return found


def own_places(renderer: FemRenderer) -> list[Asked]:
    """Straight presses at the places of the model's own presses, along their stated normals."""
    presses, deepest = renderer.model.presses, greatest_depth(renderer)
    found = []
    for at, normal, depth_m in zip(presses.point, presses.normal, presses.depth_m, strict=True):
        depth = min(float(depth_m), deepest)
        try:
            curve = press(in_the_air(renderer), at, -normal, Stroke(depth, SPEED_M_PER_S))
        except OptionError:
            continue
        found.append(Asked(at, -normal, depth, curve.force_at(depth), "own"))
    return found


def _answers(tab: Tab, asked: list[Asked], straight: bool = False) -> list[list[float]]:
    """The page's forces, N; straight: without telling it the direction."""
    found: list[list[float]] = []
    for start in range(0, len(asked), _AT_ONCE):
        some = [
            [each.at.tolist(), each.depth_m, None if straight else each.way.tolist()]
            for each in asked[start : start + _AT_ONCE]
        ]
        found += tab.evaluate(f"{json.dumps(some)}.map((each) => palpate.press(...each).force_n)")
    return found


def _figures(found: dict[str, Any]) -> list[Figure]:
    figures = []
    for name, of in found.items():
        drawn_ones = [m for kind in ("straight", "aslant") for m in of["misses"][kind]]
        within = int(np.sum(np.array(drawn_ones) <= 1))
        what = f"{name}: drawn presses within 2 % + 5 mN of palpate press"
        figures += [each.at_least(100.0) for each in rates({what: (within, len(drawn_ones))})]
        relative = of["relative"]
        drawn_too = {
            "drawn": relative["straight"] + relative["aslant"],
            "the model's own": relative["own"],
        }
        for places, differences in drawn_too.items():
            if differences:
                values = 100 * np.array(differences)
                spread = (float(values.min()), float(values.max()))
                what = f"{name}: median difference of {len(values)} forces at {places} places"
                figures.append(Figure(what, float(np.median(values)), spread, "%"))
        figures.append(Figure(f"{name}: size of the file", of["bytes"] / 1e6, None, "MB").at_most(3.0))
        for view, seen in of["views"].items():
            figures += _view_figures(f"{name}, {view}", seen)
    return figures


def _view_figures(where: str, seen: Seen) -> list[Figure]:
    cost = Figure(f"{where}: processor time of a frame", seen.cost_ms, None, "ms")
    return [
        Figure(f"{where}: frames a second drawn in software", seen.rate, seen.spread, "1/s").at_least(30.0),
        Figure(f"{where}: those over an empty page's in the same minute", seen.rate / seen.empty),
        cost.at_most(66.0, "two cores at 30 frames a second"),
        Figure(f"{where}: first paint", seen.paint_ms, None, "ms").at_most(1000.0),
        Figure(f"{where}: until it can be pressed", seen.ready_ms, None, "ms"),
    ]
