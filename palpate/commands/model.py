"""A MODEL from the shape of an object: STL, OBJ, PLY, glTF, VTP, VTU, MSH or INP, and a modulus.

The object keeps its file's frame, in metres, and stands on its flat foot (--up says which). Small and flat
holes are closed. MODEL is a folder that 'palpate touch', 'press', 'compare --model' and 'diagnose --model'
take; with a recording of the object, 'palpate reconstruct REC --shape FILE' finds the modulus instead.
"""

from __future__ import annotations

import argparse

from palpate import api
from palpate.arguments import add_input, add_json, add_model_output, emit_json, finite, say
from palpate.sources import add_mesh_arguments, given_scene

SUMMARY = "a MODEL from a surface's file and a modulus"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """FILE, -o MODEL, how the file is meant, --json."""
    add_input(parser, "shape", metavar="FILE", help="surface or mesh of the object")
    add_model_output(parser)
    add_mesh_arguments(parser)
    parser.add_argument(
        "--tip-radius", type=finite, metavar="NUMBER", help="of the tool [m] (default: 0.005)"
    )
    parser.add_argument(
        "--mesh-size",
        type=finite,
        metavar="NUMBER",
        help="edge of the tetrahedra [m] (default: 0.010 or an eighth)",
    )
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Read, mesh, write."""
    scene = given_scene(arguments, arguments.shape)
    model = api.model_of(
        scene.source,
        scene.young_modulus_pa,
        unit=scene.unit,
        up=scene.up,
        sink_m=scene.sink_m,
        poisson_ratio=scene.poisson_ratio,
        tip_radius_m=arguments.tip_radius,
        mesh_size_m=arguments.mesh_size,
        save=arguments.output,
    )
    say(arguments, *model.lines())
    emit_json(model.as_json(), arguments.json)
    return 0
