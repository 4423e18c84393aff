"""What a command is given as an object: a scene, a MODEL folder, or a surface's file with its unit and
modulus."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from mechanics.errors import OptionError
from mechanics.surface_files import UNITS, is_surface_file
from palpate.arguments import finite
from render.options import RenderOptions
from scenes.scene import Scene, load_scene

_MESH = ("unit", "up", "sink")


def with_friction(options: RenderOptions, scene: Scene) -> RenderOptions:
    """The renderers' options with the scene file's friction, where they have none of their own."""
    return options if options.friction is not None else replace(options, friction=scene.friction)


def add_mesh_arguments(parser: argparse.ArgumentParser) -> None:
    """How a surface's file (STL, OBJ, PLY, glTF, VTP, VTU, MSH, INP) is meant, where one is the object."""
    group = parser.add_argument_group("a surface's file as the object")
    group.add_argument(
        "--modulus", type=finite, metavar="NUMBER", help="Young's modulus [Pa] (default: 20000)"
    )
    group.add_argument("--nu", type=finite, metavar="NUMBER", help="Poisson's ratio (default: 0.49)")
    group.add_argument("--unit", choices=tuple(UNITS), help="of the file's lengths (default: m)")
    group.add_argument("--up", metavar="AXIS", help="out of the support: +z, -x, ... or X,Y,Z (default: +z)")
    group.add_argument(
        "--sink", type=finite, metavar="NUMBER", help="cut off flat at the bottom [m] (default: 0)"
    )


def given_scene(arguments: argparse.Namespace, name: str) -> Scene:
    """The scene of a name or path with what `add_mesh_arguments` gave.

    Raises OptionError for a unit or direction of what is no surface's file.
    """
    scene = load_scene(name)
    given = {key: getattr(arguments, key) for key in _MESH if getattr(arguments, key) is not None}
    if given and scene.kind != "mesh":
        raise OptionError(f"--{next(iter(given))} is for the file of a surface; '{name}' is a {scene.kind}")
    changes = {{"sink": "sink_m"}.get(key, key): value for key, value in given.items()}
    for flag, field in (("modulus", "young_modulus_pa"), ("nu", "poisson_ratio")):
        if getattr(arguments, flag) is not None:
            changes[field] = getattr(arguments, flag)
    if not changes.get("young_modulus_pa", 1.0) > 0:
        raise OptionError(f"--modulus is {changes['young_modulus_pa']} Pa; it must be greater than 0")
    return replace(scene, **changes)


def given_model(arguments: argparse.Namespace, name: str | None) -> str | Scene | None:
    """What `pp.load` is to load: a scene for a surface's file or where something of it was given, else the
    name itself."""
    said = [key for key in ("modulus", "nu", *_MESH) if getattr(arguments, key) is not None]
    if name is None:
        if said:
            raise OptionError(f"--{said[0]} needs --model FILE: the surface that it is about")
        return None
    return given_scene(arguments, name) if said or is_surface_file(Path(name)) else name
