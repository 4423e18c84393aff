"""A MODEL for other programs: a minimal scene that runs there, or its mesh.

mujoco (.xml): a flex on its base and the tip as a mocap sphere. sofa (.scn): tetrahedra, base, a sphere's
force. abaqus (.inp): hybrid tetrahedra, base, a rigid sphere that is pressed in. gmsh (.msh): mesh, groups,
moduli. stl: the boundary. Metres, newtons, pascals, the model's frame (an STL's lengths as --unit says).
"""

from __future__ import annotations

import argparse

from palpate import api
from palpate.arguments import add_input, add_json, emit_json, finite, say, vector
from palpate.exporting.registry import FORMATS

SUMMARY = "a MODEL for MuJoCo, SOFA, Abaqus, Gmsh, or as STL"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """MODEL, --to, -o, the press of the scene, --json."""
    add_input(parser, "model", metavar="MODEL_OR_SCENE", help="folder of a model, or a scene")
    parser.add_argument("--to", choices=tuple(FORMATS), required=True, help="the program")
    parser.add_argument("-o", "--output", metavar="PATH", required=True, help="file to write")
    parser.add_argument(
        "--at",
        type=vector,
        metavar="X,Y,Z",
        help="where the scene's tip presses [m] (default: middle of the top)",
    )
    parser.add_argument(
        "--depth", type=finite, metavar="NUMBER", help="how deep [m] (default: half the tip's radius)"
    )
    parser.add_argument("--unit", default="m", metavar="UNIT", help="of an STL's lengths (default: m)")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write, and say what the format cannot."""
    notes = api.export(
        arguments.model,
        arguments.to,
        arguments.output,
        at=arguments.at,
        depth_m=arguments.depth,
        unit=arguments.unit,
    )
    say(arguments, f"written for {arguments.to}: {arguments.output}", *(f"  {note}" for note in notes))
    emit_json({"to": arguments.to, "path": arguments.output, "notes": list(notes)}, arguments.json)
    return 0
