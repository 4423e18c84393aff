"""Other simulators on the same presses: newtons against truth, at both of their settings, with their cost.

half-space: a ball of 3 mm, 0.5 and 1 mm into the middle of a block of 60 x 60 x 30 mm (20 kPa, nu 0.45), over
Hertz. sliding: the same ball at 1 mm, sticking, moved by 0.1 mm sideways, over Mindlin's 8 G a / (2 - nu).
slab: a ball of 5 mm into a slab 6 mm thick. block, cylinder, dome: a ball of 5 mm, 1 and 2 mm into the node
nearest to the middle of the top of a known shape. Of the last four the truth is this program's renderer,
whose own error stands in the evidence of law-by-place. recording: presses of a recording (the embedded one),
spread over its places, whose truth is what was measured; the median of their peaks. A block is no half-space,
and its base is held: 1 is not quite the truth there.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import tempfile
import time
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._known_shapes import SHAPES
from benchmarks._pressed_places import meshed
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.progress import silent
from palpate.mechanics.shape.tetmesh import TetMesh, box_mesh
from palpate.render.options import SETTINGS, RenderOptions
from palpate.render.registry import create, simulator_names
from palpate.render.replay import replay

YOUNG_PA, POISSON, RATE_HZ, SPEED_M_PER_S = 20e3, 0.45, 250.0, 0.02
HOLD_S = 0.1
OURS, RECORDING = "palpate", "recording"
LONGEST_S = 600.0
"""Of one simulator over all cases."""
UP = np.array([0.0, 0.0, 1.0])
_TOP_M = 0.002
"""Below the highest node, where nodes still belong to the top."""


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

    def pressed(self, touched: Any, own: list[float] | None) -> dict[str, Any]:
        """The fields of a row. own: N, our own renderer's, which are the truth where nothing else is."""
        t, centre, rests = self.path()
        force = replay(touched, t, centre, progress=silent)
        found = np.array([force[k] @ UP for k in rests])
        if self.aside_m:
            found[-1] = -force[rests[-1]][0]
        closed = None if self.truth_n is None else [*self.truth_n, *([self.aside_n] if self.aside_m else [])]
        truth = np.array(next(each for each in (closed, own, found) if each is not None))
        return {
            "what": [f"{1e3 * d:g} mm" for d in self.depths_m] + (["sideways"] if self.aside_m else []),
            "newtons": found.tolist(),
            "over": (found / truth).tolist(),
            "samples": len(t),
        }


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which simulators and cases."""
    parser.add_argument("--only", nargs="+", choices=simulator_names(), default=list(simulator_names()))
    parser.add_argument("--cases", nargs="+", choices=(*CASES, RECORDING), default=[*CASES, RECORDING])
    parser.add_argument("--settings", nargs="+", choices=SETTINGS, default=list(SETTINGS))
    parser.add_argument("--recording", type=Path, help="whose presses are set beside the measured ones")
    parser.add_argument("--model", type=Path, help="its MODEL folder (default: reconstruct)")
    parser.add_argument("--presses", type=int, default=6, help="of the recording, over how many")
    parser.add_argument("--work", type=Path, help="folder of presses that were run: they are shown, not run")
    parser.add_argument("--kept", action="store_true", help="run nothing, show what lies in --work")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Press with each; print newtons over truth and cost; return rows and figures."""
    given = {name: getattr(arguments, name) for name in ("recording", "model", "work")}
    resolved = {name: None if path is None else path.resolve() for name, path in given.items()}
    kept = _Kept(resolved["work"])
    recorded = partial(_Recorded.of, resolved["recording"], resolved["model"], arguments.presses)
    # MuJoCo leaves its warnings in a file where it runs
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for name in () if arguments.kept else arguments.cases:
            case: Any = cache(CASES.get(name, recorded))
            _pressed(name, case, arguments.only, arguments.settings, kept)
    rows = kept.in_order()
    header = ["case", "simulator", "settings", "newtons over truth", "cost [CPU s]"]
    print(table(header, [_said(row) for row in rows]))
    return {"rows": rows, "figures": _figures(rows)}


def _figures(rows: list[dict[str, Any]]) -> list[Figure]:
    # our own cost holds what is compiled at first
    others = [r for r in rows if "failed" not in r and r["simulator"] != OURS]
    over = [
        Figure(f"{r['case']}, {r['simulator']}, {r['settings']}: {what} over truth", value, unit="1")
        for r in others
        for what, value in zip(r["what"], r["over"], strict=True)
    ]  # fmt: skip
    costs = []
    for r in others:
        words = f"{r['case']}, {r['simulator']}, {r['settings']}"
        costs.append(Figure(f"{words}: cost of the press", r["cpu_s"], unit="CPU s"))
        costs.append(Figure(f"{words}: cost a sample", 1e3 * r["cpu_s"] / r["samples"], unit="ms"))
    whole = [
        Figure(
            f"all cases that were run, {name}",
            sum(r["cpu_s"] for r in others if r["simulator"] == name),
            unit="CPU s",
        )
        for name in dict.fromkeys(r["simulator"] for r in others)
    ]
    ended = [
        Figure(f"{r['case']}, {r['simulator']}, {r['settings']}: ended without a force", 1.0, unit="1")
        for r in rows if "failed" in r
    ] + [
        Figure(
            f"{r['case']}, {r['simulator']}, {r['settings']}: presses that ended without a force",
            len(r["ended"]), unit="presses",
        )
        for r in rows if r.get("ended")
    ]  # fmt: skip
    return [*over, *costs, *(f.at_most(LONGEST_S) for f in whole), *ended]


class _Kept:
    """Rows by case, simulator and settings, and the folder in which they lie; None: only here."""

    def __init__(self, folder: Path | None) -> None:
        self.folder = folder
        self.rows: dict[tuple[str, str, str], dict[str, Any]] = {}
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            for path in sorted(folder.glob("*.json")):
                row = json.loads(path.read_text())
                self.rows[row["case"], row["simulator"], row["settings"]] = row

    def keep(self, row: dict[str, Any]) -> dict[str, Any]:
        """The row, kept."""
        key = row["case"], row["simulator"], row["settings"]
        self.rows[key] = row
        if self.folder is not None:
            (self.folder / f"{'_'.join(filter(None, key))}.json").write_text(json.dumps(row, default=float))
        return row

    def in_order(self) -> list[dict[str, Any]]:
        """By case, then simulator, as they are listed."""
        cases, names = [*CASES, RECORDING], [OURS, *simulator_names()]

        def place(row: dict[str, Any]) -> tuple[int, int, int]:
            setting = SETTINGS.index(row["settings"]) if row["settings"] else 0
            return cases.index(row["case"]), names.index(row["simulator"]), setting

        return sorted(self.rows.values(), key=place)


def _pressed(name: str, case: Any, names: list[str], settings: list[str], kept: _Kept) -> None:
    """Our own renderer first, which is the truth where nothing else is. case(): made where it is needed."""
    for simulator, setting in [(OURS, "")] + [(n, s) for n in names for s in settings]:
        if (name, simulator, setting) in kept.rows:
            continue
        own = kept.rows.get((name, OURS, ""), {}).get("newtons")
        row: dict[str, Any] = {"case": name, "simulator": simulator, "settings": setting}
        made = case()
        began = time.process_time()
        try:
            touched = create("fem" if simulator == OURS else simulator, made.model, _options(setting))
            found = made.pressed(touched, own)
        except Exception as error:  # a simulator's failure is a finding, not ours to hide or to die of
            kept.keep(row | {"failed": str(error)[:80]})
            continue
        kept.keep(row | {"cpu_s": time.process_time() - began} | found)


@dataclass(frozen=True)
class _Recorded:
    """Presses of a recording, whose truth is what was measured."""

    recording: Any
    model: Model
    presses: Any
    chosen: np.ndarray

    @classmethod
    def of(cls, path: Path | None, folder: Path | None, most: int) -> _Recorded:
        """The embedded recording where there is no path; reconstructed where there is no model."""
        from palpate.diagnosis.other_simulator.forces import spread_out
        from palpate.mechanics.model.files import read_model
        from palpate.mechanics.recording.recording import read_recording
        from palpate.operations.reconstruct import reconstruct
        from palpate.reconstruction.presses_on_model import presses_on
        from palpate.scenes.embedded import embedded_recording

        recording = read_recording(path or embedded_recording())
        model = read_model(folder) if folder else reconstruct(recording, progress=False).model
        presses = presses_on(recording, model)
        return cls(recording, model, presses, spread_out(presses, most))

    def pressed(self, touched: Any, own: list[float] | None) -> dict[str, Any]:
        """The fields of a row."""
        from palpate.render.replay import replay_touches

        presses = self.presses
        errors: dict[int, OptionError] = {}
        force = replay_touches(touched, self.recording, presses, self.chosen, failed=errors.__setitem__)
        chosen = [p for p in np.flatnonzero(self.chosen) if p not in errors]
        if not chosen:
            raise next(iter(errors.values()))
        at = np.column_stack([np.interp(presses.t, self.recording.t, f) for f in force.T])
        push = np.einsum("ni,ni->n", at, presses.normal[presses.press])
        truth = presses.net.push
        parts = [presses.parts[k] for k in chosen]
        peaks = [(float(push[p].max()), float(truth[p].max())) for p in parts]
        return {
            "what": ["median of peaks"],
            "newtons": [float(np.median([a for a, _ in peaks]))],
            "over": [float(np.median([a / b for a, b in peaks]))],
            "samples": int(sum(p.stop - p.start for p in parts)),
            "ended": [str(error) for error in errors.values()],
        }


def _options(setting: str) -> RenderOptions:
    return RenderOptions(friction=1.0, simulator_settings=setting or "documented")


def _said(row: dict[str, Any]) -> list[Any]:
    if "failed" in row:
        return [row["case"], row["simulator"], row["settings"], row["failed"], ""]
    over = ", ".join(f"{w} {x:.2f}" for w, x in zip(row["what"], row["over"], strict=True))
    if row.get("ended"):
        over += f"; {len(row['ended'])} presses ended without a force ({row['ended'][0]})"
    cost = "" if row["simulator"] == OURS else f"{row['cpu_s']:.3g}"
    return [row["case"], row["simulator"], row["settings"], over, cost]


def _model(mesh: TetMesh, radius_m: float, size_m: float) -> Model:
    low = mesh.points[mesh.fixed].mean(axis=0)
    return Model(mesh, ObjectMaterial(YOUNG_PA, POISSON), Support(low, UP), Tool(radius_m), size_m)


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
    """A node is pressed: between nodes, how far they are from a tip smaller than the elements decides what
    a simulator pushes back, and every mesh leaves another gap."""
    mesh = meshed(SHAPES[name](), 0.01)
    nodes = mesh.points[np.unique(mesh.touchable_surface)]
    top = nodes[nodes[:, 2] > nodes[:, 2].max() - _TOP_M]
    middle = (nodes[:, :2].min(axis=0) + nodes[:, :2].max(axis=0)) / 2
    pressed = top[np.argmin(np.linalg.norm(top[:, :2] - middle, axis=1))]
    return Case(name, _model(mesh, 0.005, 0.01), pressed, (0.001, 0.002))


CASES: dict[str, Any] = {
    "half-space": _half_space,
    "sliding": lambda: _half_space(1e-4),
    "slab": _slab,
    "block": lambda: _shape("block"),
    "cylinder": lambda: _shape("cylinder"),
    "dome": lambda: _shape("dome"),
}
