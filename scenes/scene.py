"""A scene: what is touched, with which tip, through which device mapping, drawn and rendered how.

A TOML file whose keys carry their units. Allowed tables and keys:

    title, about
    [object]     one of phantom (a name, or a closed surface, put with its base's centre on the origin),
    mesh (a
                 surface or mesh file in its own frame; unit, up, sink_m), model (a MODEL folder) or
                 recording; young_modulus_pa, poisson_ratio, mesh_size_m, finite_strain
    [[inclusion]] name, centre_m, radius_m, modulus_ratio       (object frame: base's centre, z up; the file's
                 frame for a mesh)
    [tool]       tip_radius_m
    [device]     axes, motion_scale, force_scale, clutch_button, reach_m
    [render]     renderer, beside, colour, friction

Paths are relative to the scene's file.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from devices.mapper import MapperOptions
from mechanics.errors import SceneError
from mechanics.surface_files import SUFFIXES, is_surface_file
from scenes.embedded import embedded_names, embedded_recording
from scenes.phantoms import PHANTOMS, Region

FOLDER = Path(__file__).parent
COLOURS = ("displacement", "stiffness")
OBJECT_KINDS = ("phantom", "mesh", "model", "recording")
_ALLOWED: dict[str, tuple[str, ...]] = {
    "": ("title", "about", "object", "inclusion", "tool", "device", "render"),
    "object": (
        *OBJECT_KINDS,
        "young_modulus_pa",
        "poisson_ratio",
        "mesh_size_m",
        "finite_strain",
        "unit",
        "up",
        "sink_m",
    ),
    "inclusion": ("name", "centre_m", "radius_m", "modulus_ratio"),
    "tool": ("tip_radius_m",),
    "device": ("axes", "motion_scale", "force_scale", "clutch_button", "reach_m"),
    "render": ("renderer", "beside", "colour", "friction"),
}


@dataclass(frozen=True)
class Scene:
    """kind, source: the object, one of OBJECT_KINDS and its name or path. Lengths m, moduli Pa.

    young_modulus_pa, poisson_ratio: None keeps the object's own. inclusions: None keeps the phantom's own.
    beside: a second renderer that the same tip drives, '' for none. friction: Coulomb coefficient, None
    sticks. unit, up, sink_m: how a mesh's file is meant (mechanics.standing). mesh_size_m: None takes 10 mm,
    less for a small object.
    """

    name: str
    kind: str
    source: str
    title: str = ""
    about: str = ""
    young_modulus_pa: float | None = None
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


def scene_names() -> list[str]:
    """Names of the embedded scenes."""
    return sorted(p.stem for p in FOLDER.glob("*.toml"))


def load_scene(name: str | Path) -> Scene:
    """A scene by its name, or from a scene file, a MODEL folder, a recording's file, or a phantom's name.

    Raises SceneError that lists what is allowed.
    """
    path = Path(name)
    if path.is_dir():
        return Scene(path.name, "model", str(path.resolve()), title=path.name)
    embedded = FOLDER / f"{name}.toml"
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
    raise SceneError(
        f"'{name}' is no scene: allowed are {', '.join(scene_names())}, a scene's .toml, a MODEL folder, a "
        f"recording ({', '.join(embedded_names())} or a file), a phantom ({', '.join(PHANTOMS)}), or a "
        f"file of a surface or mesh ({', '.join(SUFFIXES)})"
    )


def read_scene(path: Path | str) -> Scene:
    """A scene file; raises SceneError where it is no TOML, a key is unknown or a value is impossible."""
    return _scene(_toml(Path(path)), Path(path))


def _toml(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SceneError(f"'{path}' is no valid TOML: {error}") from error


def _check_keys(path: Path, table: Mapping[str, Any], name: str) -> None:
    unknown = [key for key in table if key not in _ALLOWED[name]]
    if unknown:
        where = f" in [{name}]" if name else ""
        raise SceneError(
            f"'{path}' has the key {unknown[0]!r}{where}: allowed are {', '.join(_ALLOWED[name])} "
            "(keys carry their units: _m, _pa)"
        )


def _scene(table: Mapping[str, Any], path: Path) -> Scene:
    _check_keys(path, table, "")
    for name in ("object", "tool", "device", "render"):
        if not isinstance(table.get(name, {}), Mapping):
            raise SceneError(f"'{path}': [{name}] must be a table")
        _check_keys(path, table.get(name, {}), name)
    thing, render = table.get("object", {}), table.get("render", {})
    kinds = [kind for kind in OBJECT_KINDS if kind in thing]
    if len(kinds) != 1:
        raise SceneError(f"'{path}': [object] needs exactly one of {', '.join(OBJECT_KINDS)}; it has {kinds}")
    kind = kinds[0]
    device = dict(table.get("device", {}))
    if "motion_scale" in device:
        device["scale"] = device.pop("motion_scale")
    try:
        return Scene(
            name=path.stem,
            kind=kind,
            source=_source(kind, str(thing[kind]), path),
            title=str(table.get("title", path.stem)),
            about=str(table.get("about", "")),
            young_modulus_pa=_positive(thing, "young_modulus_pa"),
            poisson_ratio=None if "poisson_ratio" not in thing else float(thing["poisson_ratio"]),
            mesh_size_m=_positive(thing, "mesh_size_m"),
            unit=str(thing.get("unit", "m")),
            up=str(thing.get("up", "+z")),
            sink_m=float(thing.get("sink_m", 0.0)),
            finite_strain=bool(thing.get("finite_strain", True)),
            inclusions=_inclusions(path, table.get("inclusion")),
            tip_radius_m=_positive(table.get("tool", {}), "tip_radius_m"),
            mapper=MapperOptions(**device),
            renderer=str(render.get("renderer", "fem")),
            beside=str(render.get("beside", "")),
            colour=_one_of(render.get("colour", "displacement"), COLOURS),
            friction=None if "friction" not in render else float(render["friction"]),
        )
    except (TypeError, ValueError) as error:
        raise SceneError(f"'{path}' holds a value of the wrong kind: {error}") from error


def _source(kind: str, value: str, path: Path) -> str:
    """Names stay names; paths become absolute, from the scene file's folder."""
    if kind == "phantom" and value in PHANTOMS or kind == "recording" and value in embedded_names():
        return value
    return str((path.parent / value).resolve())


def _positive(table: Mapping[str, Any], key: str) -> float | None:
    return None if key not in table else _required(table, key)


def _required(table: Mapping[str, Any], key: str) -> float:
    value = float(table[key])
    if not value > 0:
        raise ValueError(f"{key} is {value}; it must be greater than 0")
    return value


def _one_of(value: Any, allowed: tuple[str, ...]) -> str:
    if value not in allowed:
        raise ValueError(f"'{value}' is not allowed; allowed are {', '.join(allowed)}")
    return str(value)


def _inclusions(path: Path, tables: Any) -> tuple[Region, ...] | None:
    if tables is None:
        return None
    regions = []
    for number, table in enumerate(tables):
        _check_keys(path, table, "inclusion")
        missing = [k for k in ("centre_m", "radius_m", "modulus_ratio") if k not in table]
        if missing:
            raise SceneError(f"'{path}': inclusion {number + 1} lacks {', '.join(missing)}")
        x, y, z = (float(v) for v in table["centre_m"])
        radius, ratio = _required(table, "radius_m"), _required(table, "modulus_ratio")
        regions.append(Region(str(table.get("name", f"inclusion {number + 1}")), (x, y, z), radius, ratio))
    return tuple(regions)
