"""Which programs a model can be written for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.exporting import abaqus, gmsh, mujoco, scripts, sofa, stl, usd
from palpate.exporting.recorded import Recorded
from palpate.exporting.subject import DEPTH_RADII, Subject, subject_of
from palpate.mechanics.disk.surface_files import UNITS
from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.errors import OptionError
from palpate.mechanics.extras import install_words
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress, silent

if TYPE_CHECKING:
    from palpate.scenes.scene import Scene

Writer = Callable[[Path, Subject], tuple[str, ...]]


def _page(path: Path, subject: Subject, **more: Any) -> tuple[str, ...]:
    """`palpate.exporting.page.document.write`, whose libraries the help of the command need not load."""
    from palpate.exporting.page import document

    return document.write(path, subject, **more)


@dataclass(frozen=True)
class ExportFormat:
    """A program's file: its suffix, its writer, which returns what the format cannot say, how such a file
    begins, and what to do with it ({path}: the file; commands between backticks). depth_radii: depth of a
    press that nobody said, in radii of the tip."""

    suffix: str
    write: Writer
    kind: Kind
    opened_by: str
    depth_radii: float = DEPTH_RADII


_SCRIPT = Kind("a script of palpate export", (b"# Palpate model",))
FORMATS = {
    "mujoco": ExportFormat(
        ".xml",
        mujoco.write,
        Kind("a scene of palpate export", (b"<!-- Palpate model",)),
        "look at it: `python -m mujoco.viewer --mjcf={path}`",
        mujoco.DEPTH_RADII,
    ),
    "sofa": ExportFormat(
        ".scn",
        sofa.write,
        Kind("a scene of palpate export", (b"<?xml",), holds=b"<!-- Palpate model"),
        "run it: `runSofa {path}`",
    ),
    "abaqus": ExportFormat(
        ".inp",
        abaqus.write,
        Kind("a deck of palpate export", (b"*Heading\n Palpate model",)),
        "solve it with Abaqus or CalculiX: the reference point's force is the press",
    ),
    "gmsh": ExportFormat(
        ".msh",
        gmsh.write,
        Kind("a mesh of palpate export", (b"$MeshFormat",), holds=b"young_modulus_pa"),
        "look at it: `gmsh {path}`",
    ),
    "page": ExportFormat(
        ".html",
        _page,
        Kind("a page of palpate export", (b"<!doctype html>",), holds=b"Made by palpate"),
        "open {path} in any browser, and press",
    ),
    "usd": ExportFormat(
        ".usda",
        usd.write,
        Kind("a stage of palpate export", (b"#usda 1.0",), holds=b"Palpate model"),
        "look at it: `usdview {path}`",
    ),
    "newton": ExportFormat(".py", scripts.write_newton, _SCRIPT, "press it: `python {path}`"),
    "drake": ExportFormat(".py", scripts.write_drake, _SCRIPT, "press it: `python {path}`"),
    "stl": ExportFormat(
        ".stl",
        stl.write,
        Kind("an STL of palpate export", (stl.HEADER,)),
        "open {path} in any program that draws or prints shapes",
    ),
}


@dataclass(frozen=True)
class RecordedFormat:
    """A format that a recording is written in. module: whose `write(path, recorded, progress)` returns what
    the file does not say; extra: that has its libraries; the others as in `ExportFormat`."""

    suffix: str
    module: str
    extra: str
    kind: Kind
    opened_by: str


RECORDED = {
    "mcap": RecordedFormat(
        ".mcap",
        "palpate.exporting.mcap",
        "mcap",
        Kind("an MCAP", (b"\x89MCAP0\r\n",)),
        "play it: `ros2 bag play {path}`, or open it in Foxglove or PlotJuggler",
    ),
    "rerun": RecordedFormat(
        ".rrd",
        "palpate.exporting.rerun",
        "rerun",
        Kind("a recording of Rerun", (b"RRF",)),
        "look at it: `rerun {path}`",
    ),
}


def write_recorded(told: Recorded, to: str, path: Path | str, progress: Progress = silent) -> tuple[str, ...]:
    """Write a recording for another program; what its format cannot say, one line each. Raises OptionError
    for another suffix, or where its library is not installed."""
    chosen, path = RECORDED[to], Path(path)
    check_recorded(to, path)
    try:
        with atomic_file(path, chosen.kind) as temporary:
            return import_module(chosen.module).write(temporary, told, progress)
    except ImportError as error:
        raise OptionError(
            f"--to {to} needs {error.name}, which is not installed: {install_words(chosen.extra)}"
        ) from error


def check_recorded(to: str, path: Path) -> None:
    """Raise OptionError for a suffix that does not fit."""
    if path.suffix.lower() != RECORDED[to].suffix:
        raise OptionError(f"'{path}' must end in {RECORDED[to].suffix} for {to}")


def write(
    model: Model,
    to: str,
    path: Path | str,
    *,
    at: np.ndarray | None = None,
    depth_m: float | None = None,
    unit: str = "m",
    scene: Scene | None = None,
    progress: Progress = silent,
) -> tuple[str, ...]:
    """Write a model for another program; what its format cannot say, one line each.

    at, depth_m: of the press in the scene (see `subject_of`). unit: of an STL's lengths. scene: whose title
    and task a page bears. progress: of a page, whose tables take some seconds. Raises OptionError for a
    program or suffix that does not fit.
    """
    if to not in FORMATS:
        raise OptionError(f"--to is '{to}'; allowed are {', '.join(FORMATS)}")
    program = FORMATS[to]
    path = Path(path)
    if path.suffix.lower() != program.suffix:
        raise OptionError(f"'{path}' must end in {program.suffix} for {to}")
    if unit not in UNITS or (unit != "m" and to != "stl"):
        allowed = ", ".join(UNITS) if to == "stl" else "m: the other formats are in metres"
        raise OptionError(f"--unit is '{unit}'; allowed are {allowed}")
    if depth_m is not None and not depth_m > 0:
        raise OptionError(f"--depth is {depth_m} m; it must be greater than 0")
    subject = subject_of(model, at, depth_m, program.depth_radii)
    asked = at is not None or depth_m is not None
    more: dict[str, dict[str, Any]] = {
        "stl": {"unit": unit},
        "page": {"opens": asked, "scene": scene, "progress": progress},
    }
    chosen = partial(program.write, **more.get(to, {}))
    with atomic_file(path, program.kind) as temporary:
        notes = chosen(temporary, subject)
    felt = to == "page"  # its tables are of the renderer, which renders them
    lost = [f"not in the file: {', '.join(subject.left_out)}"] if subject.left_out and not felt else []
    return (*notes, *lost)
