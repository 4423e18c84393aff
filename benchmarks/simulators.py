"""Other simulators on the same presses: newtons against truth, at both of their settings, with their cost.

half-space: a ball of 3 mm, 0.5 and 1 mm into the middle of a block of 60 x 60 x 30 mm (20 kPa, nu 0.45), over
Hertz. sliding: the same ball at 1 mm, sticking, moved by 0.1 mm sideways, over Mindlin's 8 G a / (2 - nu).
slab: a ball of 5 mm into a slab 6 mm thick. block, cylinder, dome: a ball of 5 mm, 1 and 2 mm into the middle
of the top of a known shape. Of the last four the truth is this program's renderer, whose own error stands in
the evidence of law-by-place. recording: every press of a recording, whose truth is what was measured. A block
is no half-space, and its base is held: 1 is not quite the truth there.
"""

from __future__ import annotations

import argparse
import contextlib
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._known_shapes import SHAPES
from benchmarks.evidence import Figure
from benchmarks.felt_surface import meshed
from benchmarks.timing import table
from mechanics.box_mesh import box_mesh
from mechanics.errors import OptionError
from mechanics.material import Material
from mechanics.model import Model, Support, Tool
from mechanics.progress import silent
from mechanics.tetmesh import TetMesh
from render.options import SETTINGS, RenderOptions
from render.registry import create, simulator_names
from render.replay import replay

YOUNG_PA, POISSON, RATE_HZ, SPEED_M_PER_S = 20e3, 0.45, 250.0, 0.02
HOLD_S = 0.1
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Case:
    """A press straight down on a model's top, then sideways. truth_n: by depth, N along the normal; aside_n:
    N for `aside_m` sideways at the greatest depth; None where our own renderer says it."""

    name: str
    model: Model
    top: np.ndarray
    depths_m: tuple[float, ...]
    aside_m: float = 0.0
    truth_n: tuple[float, ...] | None = None
    aside_n: float = 0.0

    def path(self) -> tuple[np.ndarray, np.ndarray, list[int]]:
        """(t (n,) s, the tip's centre (n, 3) m, the row at the end of each rest)."""
        radius, step = self.model.tool.tip_radius_m, SPEED_M_PER_S / RATE_HZ
        way, rests, at = [np.arange(-1e-3, 0.0, step)], [], 0.0
        for depth in self.depths_m:
            way += [np.arange(at, depth, step), np.full(round(HOLD_S * RATE_HZ), depth)]
            at = depth
            rests.append(sum(map(len, way)) - 1)
        down = np.concatenate(way)
        aside = np.zeros(len(down))
        if self.aside_m:
            more = np.append(
                np.arange(0.0, self.aside_m, step), np.full(round(HOLD_S * RATE_HZ), self.aside_m)
            )
            aside, down = np.append(aside, more), np.append(down, np.full(len(more), at))
            rests.append(len(down) - 1)
        centre = self.top + (radius - down[:, None]) * UP + aside[:, None] * [1.0, 0.0, 0.0]
        return np.arange(len(down)) / RATE_HZ, centre, rests


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which simulators and cases."""
    parser.add_argument("--only", nargs="+", choices=simulator_names(), default=list(simulator_names()))
    parser.add_argument("--cases", nargs="+", choices=tuple(CASES), default=list(CASES))
    parser.add_argument("--settings", nargs="+", choices=SETTINGS, default=list(SETTINGS))
    parser.add_argument("--recording", type=Path, help="whose presses are set beside the measured ones")
    parser.add_argument("--model", type=Path, help="its MODEL folder (needed for --recording)")
    parser.add_argument("--page", type=Path, help="write a page with a curve for each case (HTML)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Press with each; print newtons over truth and cost; return rows and figures."""
    if arguments.recording is not None and arguments.model is None:
        raise OptionError("--recording needs --model: simulators press a MODEL")
    given = {name: getattr(arguments, name) for name in ("recording", "model", "page")}
    resolved = {name: None if path is None else path.resolve() for name, path in given.items()}
    rows: list[dict[str, Any]] = []
    # MuJoCo leaves its warnings in a file where it runs
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for case in (CASES[name]() for name in arguments.cases):
            rows += _pressed(case, arguments.only, arguments.settings)
        recording, model = resolved["recording"], resolved["model"]
        if recording is not None and model is not None:
            rows += list(_recorded(recording, model, arguments))
    header = ["case", "simulator", "settings", "newtons over truth", "cost [CPU s]"]
    print(table(header, [_said(row) for row in rows]))
    if resolved["page"] is not None:
        _write(rows, resolved["page"])
    figures = [
        Figure(f"{r['case']}, {r['simulator']}, {r['settings']}: {what} over truth", value, unit="1")
        for r in rows if "failed" not in r and r["simulator"] != "palpate"
        for what, value in zip(r["what"], r["over"], strict=True)
    ]  # fmt: skip
    costs = [
        Figure(f"{r['case']}, {r['simulator']}, {r['settings']}: cost of the press", r["cpu_s"], unit="CPU s")
        for r in rows if "failed" not in r
    ]  # fmt: skip
    return {"rows": [{k: v for k, v in r.items() if k != "curve"} for r in rows], "figures": figures + costs}


def _pressed(case: Case, names: list[str], settings: list[str]) -> Iterator[dict[str, Any]]:
    """Our own renderer first, which is the truth where nothing else is."""
    truth = (
        None if case.truth_n is None else np.array([*case.truth_n, *([case.aside_n] if case.aside_m else [])])
    )
    what = [f"{1e3 * d:g} mm" for d in case.depths_m] + (["sideways"] if case.aside_m else [])
    t, centre, rests = case.path()
    for name, setting in [("palpate", "")] + [(n, s) for n in names for s in settings]:
        row: dict[str, Any] = {"case": case.name, "simulator": name, "settings": setting, "what": what}
        began = time.process_time()
        try:
            made = create("fem" if name == "palpate" else name, case.model, _options(setting))
            force = replay(made, t, centre, progress=silent)
        except Exception as error:  # a simulator's failure is a finding, not ours to hide or to die of
            yield row | {"failed": str(error)[:80]}
            continue
        row["cpu_s"] = time.process_time() - began
        found = np.array([force[k] @ UP for k in rests])
        if case.aside_m:
            found[-1] = -force[rests[-1]][0]
        truth = found if truth is None else truth
        down = case.top[2] + case.model.tool.tip_radius_m - centre[:, 2]
        keep = slice(None, rests[len(case.depths_m) - 1] + 1)
        curve = (1e3 * down[keep], force[keep] @ UP)
        yield row | {"newtons": found.tolist(), "over": (found / truth).tolist(), "curve": curve}


def _recorded(path: Path, folder: Path, arguments: argparse.Namespace) -> Iterator[dict[str, Any]]:
    """Peak force of each press over the measured one, the median over presses."""
    from mechanics.model_files import read_model
    from mechanics.recording import read_recording
    from reconstruct.placing import presses_on
    from render.replay import replay_recording

    recording, model = read_recording(path), read_model(folder)
    presses = presses_on(recording, model)
    t, parts = presses.t, presses.parts
    measured = np.linalg.norm(presses.force - presses.free_air, axis=1)
    for name, setting in [("palpate", "")] + [(n, s) for n in arguments.only for s in arguments.settings]:
        row: dict[str, Any] = {"case": path.name, "simulator": name, "settings": setting}
        row["what"] = ["median of presses"]
        began = time.process_time()
        try:
            made = create("fem" if name == "palpate" else name, model, _options(setting))
            force = replay_recording(made, recording)
        except Exception as error:  # as above
            yield row | {"failed": str(error)[:80]}
            continue
        row["cpu_s"] = time.process_time() - began
        at = np.column_stack([np.interp(t, recording.t, f) for f in force.T])
        size = np.linalg.norm(at, axis=1)
        ratio = [float(size[p].max() / measured[p].max()) for p in parts]
        deepest = parts[int(np.argmax([measured[p].max() for p in parts]))]
        curve = (1e3 * presses.depth[deepest], size[deepest])
        yield row | {"newtons": [float(np.median(size))], "over": [float(np.median(ratio))], "curve": curve}


def _options(setting: str) -> RenderOptions:
    return RenderOptions(friction=1.0, simulator_settings=setting or "documented")


def _said(row: dict[str, Any]) -> list[Any]:
    if "failed" in row:
        return [row["case"], row["simulator"], row["settings"], row["failed"], ""]
    over = ", ".join(f"{w} {x:.2f}" for w, x in zip(row["what"], row["over"], strict=True))
    return [row["case"], row["simulator"], row["settings"], over, row["cpu_s"]]


def _write(rows: list[dict[str, Any]], path: Path) -> None:
    """A table, and the curves of every case."""
    from palpate.show.page import Page, new_figure

    page = Page("Simulators that press the same objects")
    page.paragraph((__doc__ or "").split("\n\n", 1)[1])
    page.table(
        ["case", "simulator", "settings", "newtons over truth", "cost [CPU s]"], [_said(r) for r in rows]
    )
    for case in dict.fromkeys(row["case"] for row in rows):
        figure = new_figure(7, 3.6, layout="constrained")
        ax = figure.subplots()
        for row in (r for r in rows if r["case"] == case and "curve" in r):
            own = row["simulator"] == "palpate"
            style = "-" if row["settings"] != "documented" else "--"
            label = f"{row['simulator']} {row['settings']}".strip()
            ax.plot(*row["curve"], style, lw=2.0 if own else 1.2, color="k" if own else None, label=label)
        ax.set(xlabel="depth [mm]", ylabel="force [N]", title=case, xlim=(0, None))
        ax.legend(frameon=False, fontsize=8)
        ax.spines[["top", "right"]].set_visible(False)
        page.figure(figure, f"{case}: force along the way in, and as it rests; dashed as documented.")
    page.write(path)


def _model(mesh: TetMesh, radius_m: float, size_m: float) -> Model:
    low = mesh.points[mesh.fixed].mean(axis=0)
    return Model(mesh, Material(YOUNG_PA, POISSON), Support(low, UP), Tool(radius_m), size_m)


def _half_space(aside_m: float = 0.0) -> Case:
    radius, depths, height = 0.003, (0.0005, 0.001), 0.03
    model = _model(box_mesh((10, 10, 5), (0.06, 0.06, height)).quadratic(), radius, 0.006)
    hertz = tuple(4 / 3 * YOUNG_PA / (1 - POISSON**2) * np.sqrt(radius) * d**1.5 for d in depths)
    patch = np.sqrt(radius * depths[-1])
    aside = 8 * YOUNG_PA / (2 + 2 * POISSON) * patch / (2 - POISSON) * aside_m
    name = "sliding" if aside_m else "half-space"
    return Case(name, model, height * UP, depths, aside_m, hertz, aside)


def _slab() -> Case:
    height = 0.006
    model = _model(box_mesh((16, 16, 2), (0.06, 0.06, height)).quadratic(), 0.005, 0.004)
    return Case("slab", model, height * UP, (0.0005, 0.001))


def _shape(name: str) -> Case:
    mesh = meshed(SHAPES[name](), 0.01)
    top = mesh.points[np.argmax(mesh.points[:, 2])]
    middle = mesh.points[np.unique(mesh.surface)].mean(axis=0)
    return Case(name, _model(mesh, 0.005, 0.01), np.array([middle[0], middle[1], top[2]]), (0.001, 0.002))


CASES: dict[str, Any] = {
    "half-space": _half_space,
    "sliding": lambda: _half_space(1e-4),
    "slab": _slab,
    "block": lambda: _shape("block"),
    "cylinder": lambda: _shape("cylinder"),
    "dome": lambda: _shape("dome"),
}
