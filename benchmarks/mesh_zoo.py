"""Meshes as people have them, drawn by a script: how many become a model of the object, how many are refused.

Each file is given to `palpate model` as somebody would who never saw it; where that is refused, the flags
that the refusal names are taken, once or twice. A model is right where its volume is within 5 % of the
object's.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from benchmarks.evidence import rates
from palpate.mechanics.model.files import read_model

_TOLERANCE, _CURES = 0.05, 2
OUTCOMES = ("right", "right by the cure that was named", "refused", "wrong", "traceback")


@dataclass(frozen=True)
class Drawn:
    """A mesh in mm as its file has it, and the volume of the object that it means, mm^3; None: not known."""

    mesh: trimesh.Trimesh
    volume_mm3: float | None
    flags: tuple[str, ...] = ()


def _dome(radius: float = 30.0, height: float = 40.0) -> trimesh.Trimesh:
    """A half ellipsoid whose flat foot lies on z = 0."""
    angle = np.linspace(0, np.pi / 2, 25)
    profile = np.column_stack([radius * np.cos(angle), height * np.sin(angle)])
    profile[-1, 0] = 0.0
    foot = np.column_stack([np.linspace(0, radius, 8)[:-1], np.zeros(7)])
    return trimesh.creation.revolve(np.vstack([foot, profile]), sections=64)


def organ(seed: int = 0) -> trimesh.Trimesh:
    """A lumpy ellipsoid of 120 x 80 x 60 mm without a flat foot."""
    ball = trimesh.creation.icosphere(subdivisions=4, radius=1.0)
    random = np.random.default_rng(seed)
    lumps = sum(
        0.06 * np.sin(ball.vertices @ random.normal(0, 2.5, 3) + random.uniform(0, 6)) for _ in range(4)
    )
    ball.vertices = ball.vertices * (1 + lumps)[:, None] * [60, 40, 30]
    return ball


def _without(mesh: trimesh.Trimesh, gone: np.ndarray) -> trimesh.Trimesh:
    mesh = mesh.copy()
    mesh.update_faces(~gone)
    mesh.remove_unreferenced_vertices()
    return mesh


def _scan() -> Drawn:
    """A scan of a dome on a table: nothing below 2 to 5 mm was seen, and what was ends at `low`."""
    dome = _dome()
    x, _, z = dome.triangles_center.T
    seen = _without(dome, z < 3.5 + 1.5 * np.sin(x / 8))
    low = float(seen.bounds[0, 2])
    return Drawn(seen, np.pi * 30**2 * ((40 - low) - (40**3 - low**3) / (3 * 40**2)))


def _noisy() -> Drawn:
    dome = _dome()
    noisy = dome.copy()
    up = noisy.vertices[:, 2] > 1e-6
    noisy.vertices[up] += np.random.default_rng(1).normal(0, 0.15, (int(up.sum()), 3))
    return Drawn(noisy, dome.volume)


def _tilted(degrees: float) -> Drawn:
    dome = _dome()
    turned = dome.copy()
    turned.apply_transform(trimesh.transformations.rotation_matrix(np.radians(degrees), [1, 0.4, 0]))
    return Drawn(turned, dome.volume)


def _flipped() -> Drawn:
    dome = _dome()
    faces = np.array(dome.faces)
    faces[::3] = faces[::3, ::-1]
    return Drawn(trimesh.Trimesh(dome.vertices, faces, process=False), dome.volume)


def _inverted() -> Drawn:
    dome = _dome()
    dome.invert()
    return Drawn(dome, abs(dome.volume))


def _soup() -> Drawn:
    """Every triangle by itself, its corners off by micrometres."""
    dome = _dome()
    corners = np.array(dome.triangles).reshape(-1, 3)
    corners += np.random.default_rng(2).normal(0, 2e-3, corners.shape)
    return Drawn(trimesh.Trimesh(corners, np.arange(len(corners)).reshape(-1, 3), process=False), dome.volume)


def _box(extents: tuple[float, ...], at: tuple[float, ...] = (0, 0, 0)) -> trimesh.Trimesh:
    """Its foot's middle at `at`."""
    box = trimesh.creation.box(extents=extents)
    box.apply_translation(np.array(at) + [0, 0, extents[2] / 2])
    return box


def _together(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    both = trimesh.util.concatenate(meshes)
    assert isinstance(both, trimesh.Trimesh)
    return both


def _crossing() -> Drawn:
    """Two blocks that go through one another."""
    both = _together([_box((80, 30, 30)), _box((30, 80, 40))])
    return Drawn(both, 80 * 30 * 30 + 30 * 80 * 40 - 30 * 30 * 30)


def _chest() -> Drawn:
    """Two organs beside one another, one 12 mm higher."""
    left, right = organ(3), organ(4)
    left.apply_translation([70, 0, 0])
    right.apply_translation([-70, 0, 12])
    return Drawn(_together([left, right]), None)


def _pierced() -> Drawn:
    """A wide hole in the side."""
    dome = _dome()
    return Drawn(_without(dome, np.linalg.norm(dome.triangles_center - [28, 0, 15], axis=1) < 9), dome.volume)


def _twisted() -> Drawn:
    """A fan of three sheets at one edge stands in a block: that edge has three triangles."""
    block = _box((60, 50, 40))
    fin = trimesh.Trimesh(block.vertices[[1, 5, 3]] * 0.6 + [0, 0, 8], [[0, 1, 2]], process=False)
    return Drawn(_together([block, fin]), block.volume)


def _whole(mesh: trimesh.Trimesh, *flags: str) -> Drawn:
    return Drawn(mesh, abs(float(mesh.volume)), flags)


def _capped(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh.apply_translation([0, 0, -mesh.bounds[0, 2]])
    return mesh


ZOO: dict[str, Callable[[], Drawn]] = {
    "dome": lambda: _whole(_dome()),
    "dome, scanned on a table": _scan,
    "dome, noisy": _noisy,
    "dome, tilted by 7.5 degrees": lambda: _tilted(7.5),
    "dome, some triangles turned": _flipped,
    "dome, inside out": _inverted,
    "dome, a hole in its side": _pierced,
    "dome, a soup": _soup,
    "organ without a flat foot": lambda: Drawn(organ(), None),
    "two organs": _chest,
    "ball": lambda: Drawn(trimesh.creation.icosphere(subdivisions=4, radius=30), None),
    "crossing blocks": _crossing,
    "block with a fin": _twisted,
    "plate of 6 mm": lambda: _whole(_box((60, 60, 6))),
    "beam": lambda: _whole(_box((10, 10, 50))),
    "tube": lambda: _whole(_capped(trimesh.creation.annulus(r_min=15, r_max=20, height=40))),
    "ring lying": lambda: Drawn(trimesh.creation.torus(30, 10, major_sections=64), None),
    "cone": lambda: _whole(trimesh.creation.cone(radius=30, height=50, sections=64)),
    "capsule lying": lambda: Drawn(trimesh.creation.capsule(radius=20, height=60), None, ("--up", "+x")),
    "block of 12 triangles, 250 mm": lambda: _whole(_box((250, 250, 250))),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """--only."""
    parser.add_argument("--only", default="", help="shapes whose name holds this (default: all)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """{"shapes": {name: outcome, flags, words, volume_ratio}, "figures"}."""
    shapes: dict[str, dict[str, Any]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, draw) in enumerate(ZOO.items()):
            if arguments.only in name:
                shapes[name] = tried(draw(), Path(folder) / f"{number}")
                print(f"{name:32} " + "  ".join(str(x) for x in shapes[name].values()), flush=True)
    counts = {kind: sum(each["outcome"] == kind for each in shapes.values()) for kind in OUTCOMES}
    figures = rates({kind: (count, len(shapes)) for kind, count in counts.items()})
    return {"shapes": shapes, "figures": figures}


def tried(drawn: Drawn, at: Path) -> dict[str, Any]:
    """What becomes of one file, by command; `at`: a path without ending for the file and the model."""
    path = at.with_suffix(".stl")
    drawn.mesh.export(path)
    flags, tries = list(drawn.flags), 0
    while True:
        words = ["model", str(path), "--unit", "mm", *flags, "-o", f"{at}-model"]
        done = subprocess.run(
            [sys.executable, "-m", "palpate", *words], capture_output=True, text=True, check=False
        )
        said = done.stderr.strip()
        found = {"outcome": "refused", "flags": " ".join(flags), "volume_ratio": None, "said": said}
        if "Traceback" in said:
            return found | {"outcome": "traceback"}
        if done.returncode == 0:
            break
        cure = re.search(r"(--(?:sink|mesh-size|up))[ =]([-+\w.,]+)", said.split(";")[-1].split(" or ")[-1])
        if cure is None or tries == _CURES:
            return found
        flags, tries = [*flags, *cure.groups()], tries + 1
    volume = float(read_model(f"{at}-model").mesh.volumes.sum()) * 1e9
    whole = drawn.volume_mm3
    ratio = None if whole is None else round(volume / whole, 4)
    right = ratio is None or abs(ratio - 1) < _TOLERANCE
    outcome = ("right by the cure that was named" if tries else "right") if right else "wrong"
    return found | {"outcome": outcome, "volume_ratio": ratio}
