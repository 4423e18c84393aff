"""A scene: what is touched, with which tip, through which device mapping, drawn and rendered how.

A TOML file whose keys carry their units. Allowed tables and keys:

    title, about
    find         true: its inclusions are hidden, to be found (palpate touch)
    [object]     one of phantom (a name, or a closed surface, put with its base's centre on the origin),
    mesh (a
                 surface or mesh file in its own frame; unit, up, sink_m), model (a MODEL folder) or
                 recording; young_modulus_pa, poisson_ratio, mesh_size_m, finite_strain
    [[part]]     name, young_modulus_pa: of a body or label of the mesh, 0 leaves it out; [object]
                 young_modulus_pa is of the others
    [[inclusion]] name, centre_m, radius_m, modulus_ratio       (object frame: base's centre, z up; the file's
                 frame for a mesh)
    [tool]       tip_radius_m
    [device]     axes, motion_scale, force_scale, clutch_button, reach_m
    [render]     renderer, beside, colour, friction

Paths are relative to the scene's file and stay in its folder (mechanics.disk.reading.named_in).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from palpate.devices.mapper import MapperOptions, axis_matrix
from palpate.mechanics.disk.reading import named_in, read_toml
from palpate.mechanics.disk.schema import FileKey, Listed, Schema, check_table
from palpate.mechanics.disk.surface_files import SUFFIXES, is_surface_file
from palpate.mechanics.errors import OptionError, SceneError
from palpate.mechanics.model.files import models_in
from palpate.mechanics.model.material import BALL, Ball
from palpate.mechanics.names import unknown
from palpate.mechanics.plausible import PART_MODULUS, POISSON_RATIO, SPHERE, TIP_RADIUS, YOUNG_MODULUS
from palpate.scenes.embedded import embedded_names, embedded_recording
from palpate.scenes.phantoms import PHANTOMS, Region
from palpate.scenes.regions import REST

FOLDER = Path(__file__).parent
COLOURS = ("displacement", "stiffness")
OBJECT_KINDS = ("phantom", "mesh", "model", "recording")
_OPTIONAL_TIP = replace(TIP_RADIUS, required=False)
SCHEMA: Schema = {
    "title": FileKey(str),
    "about": FileKey(str),
    "find": FileKey(bool),
    "object": {
        "phantom": FileKey(str),
        "mesh": FileKey(str),
        "model": FileKey(str),
        "recording": FileKey(str),
        "young_modulus_pa": replace(YOUNG_MODULUS, required=False),
        "poisson_ratio": POISSON_RATIO,
        "mesh_size_m": FileKey(low=5e-4, high=0.2, unit="m"),
        "finite_strain": FileKey(bool),
        "unit": FileKey(str),
        "up": FileKey(str),
        "sink_m": FileKey(low=0.0, high=0.1, unit="m"),
    },
    "part": Listed({"name": FileKey(str, required=True), "young_modulus_pa": PART_MODULUS}),
    "inclusion": Listed({**BALL, "name": FileKey(str)}),
    "tool": {"tip_radius_m": _OPTIONAL_TIP, "tip": SPHERE},
    "device": {
        "axes": FileKey(str),
        "motion_scale": FileKey(low=1e-3, high=1e3),
        "force_scale": FileKey(low=0.0, high=100.0),
        "clutch_button": FileKey(int, low=-1, high=63),
        "reach_m": FileKey(low=1e-3, high=1.0, unit="m"),
    },
    "render": {
        "renderer": FileKey(str),
        "beside": FileKey(str),
        "colour": FileKey(str, choices=COLOURS),
        "friction": FileKey(low=0.0, high=100.0),
    },
}
"""What a scene's file may hold."""


FIND_M = 0.004
"""How deep one presses for what is hidden: the map of the nodule shows it best there."""


@dataclass(frozen=True)
class Scene:
    """kind, source: the object, one of OBJECT_KINDS and its name or path. Lengths m, moduli Pa.

    young_modulus_pa, poisson_ratio: None keeps the object's own; of a mesh of several parts the modulus is
    one number for all, or one by the part's name, '' for the others. inclusions: None keeps the phantom's
    own. beside: a second renderer that the same tip drives, '' for none. friction: Coulomb coefficient, None
    sticks. unit, up, sink_m: how a mesh's file is meant (mechanics.shape.flat_foot). mesh_size_m: None takes
    10 mm, less for a small object. find: the inclusions are hidden, to be found.
    """

    name: str
    kind: str
    source: str
    title: str = ""
    about: str = ""
    young_modulus_pa: float | Mapping[str, float] | None = None
    poisson_ratio: float | None = None
    mesh_size_m: float | None = None
    finite_strain: bool = True
    inclusions: tuple[Region, ...] | None = None
    tip_radius_m: float | None = None
    mapper: MapperOptions = field(default_factory=MapperOptions)
    renderer: str = "fem"
    beside: str = ""
    colour: str = "displacement"
    friction: float | None = None
    unit: str = "m"
    up: str = "+z"
    sink_m: float = 0.0
    find: bool = False

    def __post_init__(self) -> None:
        if isinstance(self.young_modulus_pa, Mapping) and self.kind != "mesh":
            raise OptionError(
                f"a modulus by name is of the parts of a mesh's file, and '{self.source}' is a {self.kind}: "
                "make its model anew with palpate model FILE --modulus NAME=PA"
            )

    @property
    def task(self) -> str:
        """What is to be done with what is hidden in it; '' where nothing is."""
        return f"{self.about} Press {1e3 * FIND_M:g} mm deep at many places." if self.find else ""

    @property
    def one_modulus_pa(self) -> float | None:
        """Pa, of the whole object; None where each part has its own, or none is said."""
        return None if isinstance(self.young_modulus_pa, Mapping) else self.young_modulus_pa


def scene_names() -> list[str]:
    """Names of the embedded scenes."""
    return sorted(p.stem for p in FOLDER.glob("*.toml"))


def load_scene(name: str | Path) -> Scene:
    """A scene by its name, or from a scene file, a MODEL folder, a recording's file, or a phantom's name.

    Raises SceneError that lists what is allowed.
    """
    path, embedded = Path(name), FOLDER / f"{name}.toml"
    if path.name == "model.toml" and path.is_file():
        raise SceneError(f"'{path}' is a part of a MODEL: name its folder, {path.parent}")
    # a MODEL goes before a scene of its name; any other folder does not
    if path.is_dir() and ((path / "model.toml").is_file() or not embedded.is_file()):
        return Scene(path.name, "model", str(path.resolve()), title=_title_of(path))
    if embedded.is_file():
        return read_scene(embedded)
    if path.name.endswith((".csv", ".csv.gz")) and path.is_file():
        return Scene(path.name.split(".")[0], "recording", str(path.resolve()), title=path.name)
    if path.suffix == ".toml" and path.is_file():
        table = _toml(path)
        if "recording" in table:
            return Scene(path.stem, "recording", str(path.resolve()), title=path.stem)
        return _scene(table, path)
    if str(name) in embedded_names():
        return Scene(str(name), "recording", str(embedded_recording(str(name))), title=str(name))
    if is_surface_file(path):
        return Scene(path.stem, "mesh", str(path.resolve()), title=path.stem)
    if str(name) in PHANTOMS:
        return Scene(path.stem, "phantom", str(name), title=path.stem)
    missing = "" if path.exists() else f"there is no file or folder {path}, and "
    beside = models_in(path.parent) if path.is_file() else []
    raise SceneError(
        (f"'{beside[0]}', beside {path.name}, is a MODEL; " if beside else missing)
        + unknown(
            str(name),
            "scene",
            scene_names(),
            f", a scene's .toml, a MODEL folder, a recording ({', '.join(embedded_names())} or a file), a "
            f"phantom ({', '.join(PHANTOMS)}), or a file of a surface or mesh ({', '.join(SUFFIXES)})",
            others=(*embedded_names(), *PHANTOMS),
        )
    )


def _title_of(folder: Path) -> str:
    """A MODEL's: what it was made from, where it says so, before the folder's name."""
    try:
        about = _toml(folder / "model.toml").get("provenance", {})
        made_from = next(str(about[key]) for key in ("recording", "phantom", "mesh") if about.get(key))
    except (SceneError, AttributeError, TypeError, StopIteration):
        return folder.name  # reading the model says what is wrong with it
    return f"{made_from} ({folder.name})"


def read_scene(path: Path | str) -> Scene:
    """A scene file; raises SceneError where it is no TOML, a key is unknown or a value is impossible."""
    return _scene(_toml(Path(path)), Path(path))


def _toml(path: Path) -> dict[str, Any]:
    return read_toml(path, SceneError)


def _scene(table: Mapping[str, Any], path: Path) -> Scene:
    check_table(table, SCHEMA, path, SceneError, strict=True)
    thing, render = table.get("object", {}), table.get("render", {})
    kinds = [kind for kind in OBJECT_KINDS if kind in thing]
    if len(kinds) != 1:
        raise SceneError(f"'{path}': [object] needs exactly one of {', '.join(OBJECT_KINDS)}; it has {kinds}")
    kind = kinds[0]
    device = dict(table.get("device", {}))
    if "motion_scale" in device:
        device["scale"] = device.pop("motion_scale")
    try:
        axis_matrix(device.get("axes", "x,y,z"))
        return Scene(
            name=path.stem,
            kind=kind,
            source=_source(kind, str(thing[kind]), path),
            title=str(table.get("title", path.stem)),
            about=str(table.get("about", "")),
            young_modulus_pa=_modulus(table),
            poisson_ratio=thing.get("poisson_ratio"),
            mesh_size_m=thing.get("mesh_size_m"),
            unit=str(thing.get("unit", "m")),
            up=str(thing.get("up", "+z")),
            sink_m=float(thing.get("sink_m", 0.0)),
            finite_strain=bool(thing.get("finite_strain", True)),
            inclusions=_inclusions(table.get("inclusion")),
            tip_radius_m=table.get("tool", {}).get("tip_radius_m"),
            mapper=MapperOptions(**device),
            renderer=str(render.get("renderer", "fem")),
            beside=str(render.get("beside", "")),
            colour=render.get("colour", "displacement"),
            friction=render.get("friction"),
            find=bool(table.get("find", False)),
        )
    except OptionError as error:
        raise SceneError(f"'{path}': {error}") from error


def _modulus(table: Mapping[str, Any]) -> float | dict[str, float] | None:
    """Of the object, or of each part of a mesh."""
    whole, parts = table["object"].get("young_modulus_pa"), table.get("part", [])
    if not parts:
        return whole
    named = {each["name"]: float(each["young_modulus_pa"]) for each in parts}
    return named if whole is None else {**named, REST: float(whole)}


def _source(kind: str, value: str, path: Path) -> str:
    """Names stay names; paths become absolute, from the scene file's folder."""
    if kind == "phantom" and value in PHANTOMS or kind == "recording" and value in embedded_names():
        return value
    return str(named_in(path, value, SceneError))


def _inclusions(tables: Any) -> tuple[Region, ...] | None:
    if tables is None:
        return None
    regions = []
    for number, table in enumerate(tables):
        x, y, z = (float(v) for v in table["centre_m"])
        name = table.get("name", f"inclusion {number + 1}")
        regions.append(Region(name, (x, y, z), float(table["radius_m"]), float(table["modulus_ratio"])))
    return tuple(regions)


def ball_of(region: Region) -> Ball:
    """The region as a part of a material; its centre in the mesh's frame."""
    return Ball(region.centre_m, region.radius_m, region.modulus_ratio)
