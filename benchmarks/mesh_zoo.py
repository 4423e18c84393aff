"""Meshes as people have them, drawn by a script: how many become a model that presses right.

Each of 60 files is given to `pp.model_of` as somebody would who never saw it; where that is refused, what the
refusal names is taken, twice at most. The model's volume is held against the object's; then it is made once
more with tetrahedra of half the size (nearly, and not at all where that takes too much work), and both are
pressed at the same places (benchmarks._zoo_presses): against one another, against Hertz where that applies,
and against the solver of a press. A hand's drawn ticks may follow (benchmarks._zoo_ticks).
"""

from __future__ import annotations

import argparse
import json
import re
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import palpate as pp
from benchmarks._zoo_damage import BROKEN, SCANS
from benchmarks._zoo_parts import PARTS, PHANTOMS
from benchmarks._zoo_presses import compare
from benchmarks._zoo_shapes import ORGANS, Drawn
from benchmarks._zoo_ticks import drawn_ticks
from benchmarks.evidence import Figure, commit_of, rates
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.model import Model

ZOO: dict[str, Callable[[], Drawn]] = {**ORGANS, **PHANTOMS, **PARTS, **SCANS, **BROKEN}
_VOLUME, _SIZES, _HERTZ, _CURES = 0.05, 0.02, 0.05, 2
_MOST, _FINER = 20_000, 0.8
"""Tetrahedra of the second mesh; where so many leave its size above this share of the first's, no second one
is made: a coarser one would be judged in its place."""
OUTCOMES = (
    "right",
    "right by the cure that was named",
    "refused, and the cure that was named is refused too",
    "refused without a cure",
    "wrong",
    "traceback",
)
_TAKEN = {
    "sink": ("sink_m", float), "mesh-size": ("mesh_size_m", float), "up": ("up", str), "unit": ("unit", str),
    "modulus": ("young_modulus_pa", float),
}  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which shapes, how many sizes and places."""
    parser.add_argument("--only", default="", help="shapes whose name holds this (default: all)")
    parser.add_argument("--first", type=int, default=len(ZOO), help="so many of them (default: all)")
    parser.add_argument("--every", type=int, default=1, help="of these each so many-th (default: 1)")
    parser.add_argument("--sizes", type=int, choices=(1, 2), default=2, help="of the mesh (default: 2)")
    parser.add_argument("--places", type=int, default=8, help="pressed on each; 0: none (default: 8)")
    parser.add_argument("--solved", type=int, default=1, help="of them solved too (default: 1)")
    parser.add_argument("--ticks", type=int, default=0, help="drawn on each, condensed (default: none)")
    parser.add_argument("--work", metavar="FILE", help="keep each shape's line there: a stopped run goes on")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """{"shapes": {name: what became of it}, "figures"}; a line is printed for each shape."""
    chosen = [name for name in ZOO if arguments.only in name][: arguments.first : arguments.every]
    setting = (arguments.sizes, arguments.places, arguments.solved, arguments.ticks)
    shapes: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(arguments.work or Path(folder) / "kept.jsonl")
        of = [commit_of(Path(__file__).parents[1]), *setting]
        done = _done(kept, of)
        for name in chosen:
            if name not in done:
                one = tried(ZOO[name](), Path(folder), *setting)
                with kept.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps({"name": name, "of": of, "found": one}, default=float) + "\n")
                done[name] = one
            shapes[name] = done[name]
            print(_line(name, shapes[name]), flush=True)
    return {"shapes": shapes, "figures": _figures(shapes)}


def _done(kept: Path, of: list[Any]) -> dict[str, dict[str, Any]]:
    """What a run of the same commit and setting found before it was stopped."""
    if not kept.is_file():
        return {}
    lines = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]
    return {line["name"]: line["found"] for line in lines if line["of"] == of}


def tried(
    drawn: Drawn, folder: Path, sizes: int = 2, places: int = 8, solved: int = 1, ticks: int = 0
) -> dict[str, Any]:
    """What becomes of one file, meshed in one or two sizes and pressed; ticks: drawn on it."""
    path, begun = folder / "shape.stl", time.process_time()
    drawn.mesh.export(path)
    found: dict[str, Any] = {"outcome": "", "given": {}, "said": "", "wrong": []}
    try:
        model = _modelled(path, drawn, found)
        if model is not None:
            finer = _finer(path, found["given"], model) if sizes > 1 else None
            models = [model] if finer is None else [model, finer]
            found |= {"sizes_mm": [1e3 * each.mesh_size_m for each in models]}
            found |= {"volume_ratio": _volume_ratio(drawn, model, found["given"])}
            if places:
                found |= compare(models, places, solved)
            if ticks:
                found |= drawn_ticks(model, ticks)
            _judge(found)
    except PalpateError as error:
        found |= {"outcome": OUTCOMES[3], "said": str(error)}
    except Exception:
        found |= {"outcome": "traceback", "said": traceback.format_exc()[-600:]}
    return found | {"cpu_s": round(time.process_time() - begun, 1)}


def _modelled(path: Path, drawn: Drawn, found: dict[str, Any]) -> Model | None:
    """The model, by the cures that refusals name; None where it stays refused."""
    given: dict[str, Any] = {"unit": drawn.unit, "up": drawn.up}
    for tries in range(_CURES + 1):
        try:
            with warnings.catch_warnings(record=True) as heard:
                warnings.simplefilter("always")
                model = pp.model_of(path, **given)
            found |= {"given": given, "said": "; ".join(str(each.message) for each in heard)}
            found["outcome"] = OUTCOMES[bool(tries)]
            return model
        except PalpateError as error:
            cure = _cure(str(error))
            found |= {"given": dict(given), "said": str(error)}
            if cure is None or tries == _CURES:
                found["outcome"] = OUTCOMES[3 if cure is None and not tries else 2]
                return None
            given |= cure
    return None


def _cure(said: str) -> dict[str, Any] | None:
    """What a refusal names last, as it is typed in Python."""
    if "--modulus PA" in said:
        return {"young_modulus_pa": 20e3}
    flags = re.findall(r"--(sink|mesh-size|up|unit)[ =]([-+\w.,]+)", said.split("' ", 1)[-1])
    if not flags:
        left_out = re.findall(r"--modulus '?([^'=]+)=0", said)
        return {"young_modulus_pa": dict.fromkeys(left_out, 0.0)} if left_out else None
    flag, value = flags[-1]
    name, kind = _TAKEN[flag]
    return {name: kind(value.rstrip(".,"))}


def _finer(path: Path, given: dict[str, Any], model: Model) -> Model | None:
    """The same at half the size of tetrahedra, or as near to half as _MOST of them allow."""
    ratio = max(0.5, (len(model.mesh.tetrahedra) / _MOST) ** (1 / 3))
    if ratio > _FINER:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pp.model_of(path, **given | {"mesh_size_m": model.mesh_size_m * ratio})


def _volume_ratio(drawn: Drawn, model: Model, given: dict[str, Any]) -> float | None:
    """The model's volume over the object's, of which a sink leaves less."""
    meant, volume = drawn.volume_mm3, 1e9 * float(model.mesh.volumes.sum())
    if meant is None or given.get("sink_m"):
        if not drawn.sound:
            return None
        meant = _over_plane(drawn.mesh, 1e3 * model.support.point, model.support.normal)
    return volume / meant


def _over_plane(mesh: Any, foot: np.ndarray, up: np.ndarray) -> float:
    """mm^3 of a closed mesh over a plane: cones from a point of it to what is left of the triangles."""
    import pyvista

    whole = pyvista.PolyData.from_regular_faces(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    left = whole.clip(normal=tuple(up), origin=tuple(foot), invert=False).triangulate()
    corners = np.asarray(left.points, dtype=float)[left.regular_faces] - foot
    return abs(float(np.linalg.det(corners).sum()) / 6)


def _judge(found: dict[str, Any]) -> None:
    """Turn the outcome into 'wrong' where a number is off; why stands in "wrong"."""
    wrong, ratio = found["wrong"], found["volume_ratio"]
    if ratio is not None and abs(ratio - 1) > _VOLUME:
        wrong.append(f"volume {ratio:.3f}")
    if "places" in found:
        if not found["pressed"]:
            wrong.append("no place could be pressed")
        elif not found["least_force_n"] > 0:
            wrong.append("a force of 0")
        if found["unsettled"]:
            wrong.append(f"{found['unsettled']} ticks unsettled")
        beside = zip(found["between_sizes"], found["stated_share"], strict=True)
        wrong += [f"sizes {x:+.3f} of {b:.3f} stated" for x, b in beside if abs(x) > _SIZES]
        wrong += [f"Hertz {x - 1:+.3f}" for x in found["over_hertz"] if abs(x - 1) > _HERTZ]
        wrong += [f"solver {x:+.3f} of {b:.3f}" for x, b in found["over_solver"] if abs(x) > b]
    if found.get("jumps"):
        wrong.append(f"{found['jumps']} jumps, {100 * found['worst_jump']:.0f} % of the force at worst")
    if wrong:
        found["outcome"] = "wrong"


def _line(name: str, one: dict[str, Any]) -> str:
    """Of a shape: outcome, what was given, volume, places, greatest differences, processor time."""
    words = [f"{name:34} {one['outcome']:18}"]
    if one.get("volume_ratio"):
        words.append(f"volume {one['volume_ratio']:.3f}")
    if "places" in one:
        words.append(f"{one['pressed']} of {one['places']} places")
        words += ["no finer mesh"] * (len(one["sizes_mm"]) == 1)
        for key, shift in (("between_sizes", 0), ("over_hertz", 1)):
            if one[key]:
                worst = max((x - shift for x in one[key]), key=abs)
                words.append(f"{key} {100 * worst:+.1f} %")
        words += [f"solver {100 * x:+.1f} of {100 * b:.1f} %" for x, b in one["over_solver"]]
        words += one["said"] if isinstance(one["said"], list) else []
    if one.get("ticks"):
        words.append(f"{one['jumps']} jumps in {one['ticks']} ticks, {one['held']} held")
    words += [str(one["given"]), f"{one['cpu_s']} s", *one["wrong"]]
    return "  ".join(words) + (f"  {one['said']}" if isinstance(one["said"], str) and one["said"] else "")


def _figures(shapes: dict[str, dict[str, Any]]) -> list[Figure]:
    """Counts of outcomes, and how far forces lie apart over all places."""
    counts = {kind: sum(one["outcome"] == kind for one in shapes.values()) for kind in OUTCOMES}
    figures = rates({kind: (count, len(shapes)) for kind, count in counts.items()})
    right = sum(counts[kind] for kind in OUTCOMES[:2]) / len(shapes)
    figures.append(Figure(f"right or by its cure, of {len(shapes)} shapes", right).at_least(55 / 60))
    for kind in OUTCOMES[4:]:
        figures.append(Figure(f"shapes that end {kind}", counts[kind]).at_most(0))

    def gathered(key: str) -> np.ndarray:
        return np.array([x for one in shapes.values() for x in one.get(key, [])], dtype=float)

    if drawn := sum(one.get("ticks", 0) for one in shapes.values()):
        for key, what in (("jumps", "whose force jumps"), ("held", "that hold the last force")):
            count = sum(one.get(key, 0) for one in shapes.values())
            figures.append(
                Figure(f"ticks {what}, of {drawn}", count).at_most(0 if key == "jumps" else 3e-3 * drawn)
            )

    sizes, hertz, solver = gathered("between_sizes"), gathered("over_hertz") - 1, gathered("over_solver")
    meshed = [one for one in shapes.values() if "sizes_mm" in one]
    alone = sum(len(one["sizes_mm"]) == 1 for one in meshed)
    figures.append(Figure(f"shapes without a finer mesh to hold them against, of {len(meshed)}", alone))
    if len(sizes):
        within = float((np.abs(sizes) <= _SIZES).mean())
        what = f"forces of two mesh sizes within 2 % of each other, of {len(sizes)}"
        figures.append(Figure(what, within).at_least(1.0))
        figures.append(_spread("force on the finer mesh over that on the first, less 1", sizes))
    if len(hertz):
        figures.append(_spread(f"force over Hertz's, less 1, at {len(hertz)} places", hertz))
    if len(solver):
        within = float((np.abs(solver[:, 0]) <= solver[:, 1]).mean())
        what = f"forces within the stated width of the solved press, of {len(solver)}"
        figures.append(Figure(what, within).at_least(0.95))
        figures.append(_spread("force less the solved press's, of the force", solver[:, 0]))
    return figures


def _spread(what: str, values: np.ndarray) -> Figure:
    low, middle, high = (100 * float(x) for x in np.percentile(values, [2.5, 50, 97.5]))
    return Figure(f"{what}: median (middle 95 %)", middle, (low, high), "%")
