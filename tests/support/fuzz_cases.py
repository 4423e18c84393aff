"""What is damaged, by target: the sound inputs, and a case drawn from each."""

from __future__ import annotations

import argparse
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate import cli
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.recording.recording import read_recording, write_recording
from palpate.mechanics.shape.tetmesh import box_mesh
from palpate.scenes.embedded import embedded_names, embedded_recording

from .device_bytes import MESSAGES
from .mutations import EXTREMES, MUTATIONS, OF_SAMPLES, Mutation

PRESS = ("--at", "0,0,0.03", "--direction", "0,0,-1", "--depth", "0.002", "--speed", "0.02")
_MESH_M = "0.015"
_ENDLESS = ("--seconds",)
"""Options that may ask for hours, and get them."""


@dataclass(frozen=True)
class Case:
    """A damaged input: argv of the command, what was done, where it lies.

    curve, modulus: files that hold an answer to be compared with the sound one's. edited: a value was
    changed that people may change, so that another answer is no wonder. many: inputs in this case.
    """

    target: str
    folder: Path
    argv: tuple[str, ...]
    how: str
    curve: Path | None = None
    modulus: Path | None = None
    edited: bool = False
    many: int = 1

    @property
    def outputs(self) -> list[Path]:
        """What the command writes, which a refusal must not leave."""
        return [self.folder / "out" / word for word in ("curve.csv", "MODEL", "rec.csv", "forces.csv")]


class Sound:
    """The inputs before they are damaged, in `folder`; `deep` is the share of recordings reconstructed."""

    def __init__(self, folder: Path, deep: float) -> None:
        self.folder, self.deep = folder / "sound", deep
        self.recording = write_recording(self.folder / "rec.csv", _half())
        self.model = write_model(self.folder / "MODEL", cube())
        self.scene = self.folder / "scene.toml"
        self.scene.write_text(_SCENE)
        self.files = _files_of_others(self.folder / "others", self.recording)
        self.surfaces = _surfaces(self.folder / "surfaces", self.model)

    def warming(self) -> list[list[str]]:
        """Commands that load and compile what the cases need: also with a MODEL whose cache is not there."""
        fresh, out = self.folder / "fresh", self.folder / "warm"
        shutil.copytree(self.model, fresh, dirs_exist_ok=True)
        for cache in fresh.glob("compliance-*.bin"):
            cache.unlink()
        return [
            ["press", str(fresh), *PRESS, "-o", str(out / "curve.csv")],
            ["press", str(self.model), *PRESS, "-o", str(self.folder / "curve.csv")],
            ["press", str(self.scene), *PRESS, "-o", str(self.folder / "scene.csv")],
            ["check", str(self.recording), "--json", str(out / "check.json")],
            ["touch", str(self.model), "--headless", "--seconds", "0.1"],
        ]

    def reconstruction(self) -> list[str]:
        """The command whose modulus is compared."""
        return _reconstruct(self.recording, self.folder)

    def drawn(self, target: str, random: np.random.Generator, folder: Path) -> Case:
        """One case of a target, in `folder`, which is made anew."""
        shutil.rmtree(folder, ignore_errors=True)
        (folder / "out").mkdir(parents=True)
        return _DRAW[target](self, random, folder)


def cube() -> Model:
    """Of 40 mm: what is damaged is computed anew, and that costs seconds where the object is small."""
    mesh = box_mesh((3, 3, 3), (0.04, 0.04, 0.04)).quadratic()
    return Model(
        mesh, ObjectMaterial(20e3, 0.49), Support(np.zeros(3), np.array([0.0, 0.0, 1.0])), Tool(0.005), 0.0133
    )


def _half() -> Any:
    whole = read_recording(embedded_recording(embedded_names()[0]))
    rows = slice(0, len(whole.t) // 2)
    return replace(
        whole, t=whole.t[rows], position=whole.position[rows], force_on_tool=whole.force_on_tool[rows],
        quaternion=None if whole.quaternion is None else whole.quaternion[rows],
    )  # fmt: skip


def _reconstruct(recording: Path, folder: Path) -> list[str]:
    return ["reconstruct", str(recording), "-o", str(folder / "out" / "MODEL"), "--mesh-size", _MESH_M,
            "--json", str(folder / "out" / "model.json")]  # fmt: skip


_SCENE = """title = "A block"
[object]
model = "MODEL"
[tool]
tip_radius_m = 0.005
[device]
axes = "x,y,z"
motion_scale = 1.0
force_scale = 1.0
reach_m = 0.1
[render]
renderer = "fem"
friction = 0.5
"""


def _files_of_others(folder: Path, recording: Path) -> list[Path]:
    """The recording as other programs write it."""
    folder.mkdir()
    table = np.loadtxt(recording, delimiter=",", skiprows=1)[::10, :7]
    names = ("t", "x", "y", "z", "fx", "fy", "fz")
    columns = dict(zip(names, table.T, strict=True))
    np.savez(folder / "log.npz", **columns)
    np.savetxt(folder / "log.tsv", table, delimiter="\t", header="\t".join(names), comments="", fmt="%.7g")
    from scipy.io import savemat

    savemat(folder / "log.mat", columns)
    try:
        import h5py
    except ImportError:
        return sorted(folder.iterdir())
    with h5py.File(folder / "log.h5", "w") as file:
        for name, values in columns.items():
            file[name] = values
    return sorted(folder.iterdir())


def _surfaces(folder: Path, model: Path) -> list[Path]:
    """The block's surface in formats of other programs."""
    import meshio
    import trimesh

    folder.mkdir()
    mesh = read_model(model).mesh
    corners = mesh.surface[:, :3]
    solid = trimesh.Trimesh(mesh.points, corners)
    for ending in ("stl", "obj", "ply", "glb"):
        solid.export(folder / f"block.{ending}")
    flat = meshio.Mesh(mesh.points, [("tetra", mesh.tetrahedra[:, :4])])
    for ending in ("vtu", "msh", "inp"):
        meshio.write(folder / f"block.{ending}", flat)
    return sorted(folder.iterdir())


def _chosen(random: np.random.Generator, among: Sequence[Any]) -> Any:
    return among[int(random.integers(len(among)))]


def _damage(file: Path, random: np.random.Generator, by: Sequence[Mutation] = MUTATIONS) -> str:
    mutation = _chosen(random, by)
    file.write_bytes(mutation(file.read_bytes(), random))
    return f"{mutation.__name__} in {file.name}"


def _recording(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    for file in sound.recording.parent.glob("rec.*"):
        shutil.copy(file, folder / file.name)
    chosen = folder / ("rec.csv" if random.random() < 0.6 else "rec.toml")
    samples = chosen.suffix == ".csv"
    how = _damage(chosen, random, OF_SAMPLES if samples else MUTATIONS)
    if random.random() < sound.deep:
        argv = _reconstruct(folder / "rec.csv", folder)
        return Case("recording", folder, tuple(argv), how, modulus=Path(argv[-1]), edited=True)
    argv = ["check", str(folder / "rec.csv"), "--json", str(folder / "out" / "check.json")]
    return Case("recording", folder, tuple(argv), how)


def _model(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    copied = Path(shutil.copytree(sound.model, folder / "MODEL"))
    chosen = _chosen(random, sorted(p for p in copied.iterdir() if p.is_file()))
    how = _damage(chosen, random)
    curve = folder / "out" / "curve.csv"
    argv = ("press", str(copied), *PRESS, "-o", str(curve))
    return Case("model", folder, argv, how, curve, edited=chosen.name == "model.toml")


def _scene(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    shutil.copytree(sound.model, folder / "MODEL")
    scene = Path(shutil.copy(sound.scene, folder / "scene.toml"))
    how = _damage(scene, random)
    curve = folder / "out" / "curve.csv"
    return Case("scene", folder, ("press", str(scene), *PRESS, "-o", str(curve)), how, curve, edited=True)


def _options(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    out = folder / "out"
    base = _chosen(random, (
        ["press", str(sound.model), *PRESS, "-o", str(out / "curve.csv")],
        ["press", str(sound.model), *PRESS, "-o", str(out / "curve.csv")],
        ["replay", str(sound.model), str(sound.recording), "-o", str(out / "forces.csv")],
        ["touch", str(sound.model), "--headless", "--seconds", "0.2"],
        ["touch", str(sound.model), "--headless", "--seconds", "0.2"],
        ["check", str(sound.recording)],
        ["import", str(sound.files[0]), "-o", str(out / "rec.csv"), "--tip-radius", "0.005"],
        ["model", str(sound.surfaces[-1]), "-o", str(out / "MODEL"), "--mesh-size", _MESH_M],
        ["export", str(sound.model), "--to", "stl", "-o", str(out / "block.stl")],
        ["simulate", "block", "-o", str(out / "rec.csv"), "--presses", "4"],
        ["reconstruct", str(sound.recording), "-o", str(out / "MODEL")],
        ["compare", str(sound.recording)], ["diagnose", str(sound.recording)],
        ["demo", str(sound.recording), "-o", str(out / "demo"), "--no-window"],
        ["batch", str(sound.recording), "-o", str(out / "batch"), "--workers", "1"],
    ))  # fmt: skip
    # of a command without values one that is none
    flag, number = _chosen(random, _flags(base[0]) or [("--not-an-option", False)])
    # what goes on for minutes gets only what can be no value
    long = base[0] in ("simulate", "reconstruct", "compare", "diagnose", "demo", "batch")
    absurd = [e.decode() for e in EXTREMES] if not long else list(_NO_VALUE)
    drawn = f"{10.0 ** random.uniform(-12, 12) * random.choice([1, -1]):.3g}"
    value = drawn if number and not long and random.random() < 0.6 else _chosen(random, absurd)
    argv = (*base, f"{flag}={value}")
    return Case("options", folder, argv, f"{base[0]} {flag}={value[:20]}", edited=True)


_NO_VALUE = ("nan", "-inf", "-1e308", "x", "9" * 400, "1e999", "[1, 2]")


def _flags(command: str) -> list[tuple[str, bool]]:
    """(option, whether it takes a number) of a command, those left out that may mean a long time."""
    parser, _, _ = cli._loaded([command])
    taking = [a for a in parser._actions if a.option_strings and a.nargs is None and a.type is not None]
    return [
        (action.option_strings[-1], action.type is not Path)
        for action in taking
        if action.option_strings[-1] not in _ENDLESS and not isinstance(action, argparse._StoreTrueAction)
    ]


def _file_of_others(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    file = Path(shutil.copy(_chosen(random, sound.files), folder))
    how = _damage(file, random)
    argv = ("import", str(file), "-o", str(folder / "out" / "rec.csv"), "--tip-radius", "0.005",
            "--picture", "none")  # fmt: skip
    return Case("import", folder, argv, how, edited=True)


def _surface(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    file = Path(shutil.copy(_chosen(random, sound.surfaces), folder))
    how = _damage(file, random)
    argv = ("model", str(file), "-o", str(folder / "out" / "MODEL"), "--mesh-size", _MESH_M)
    return Case("surface", folder, argv, how, edited=True)


def _bytes(sound: Sound, random: np.random.Generator, folder: Path) -> Case:
    seed = int(random.integers(1 << 31))
    return Case("device bytes", folder, ("#bytes", str(seed)), f"seed {seed}", many=MESSAGES)


_DRAW: dict[str, Callable[[Sound, np.random.Generator, Path], Case]] = {
    "recording": _recording, "model": _model, "scene": _scene, "options": _options,
    "import": _file_of_others, "surface": _surface, "device bytes": _bytes,
}  # fmt: skip
TARGETS = tuple(_DRAW)
SHARES = (6, 6, 3, 6, 3, 2, 2)
"""Of the targets, in so many cases of their sum."""
