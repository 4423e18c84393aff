"""A recorded tip path through a renderer, headless: t,fx,fy,fz in s and N, the force on the tool.

The tip starts in the air; contact is found on the model's surface and its support alone, without looking at
the measured force. The same MODEL and REC give bit-identical output. What is printed compares with the
measured force over the contact samples: phase II, from first touch to its loss and 50 ms around.
"""

from __future__ import annotations

import argparse

from palpate import api
from palpate.arguments import add_input, add_json, add_options_of, add_output, emit_json, given_for, say

SUMMARY = "a recorded tip path through a renderer, headless"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """MODEL, REC, -o, the renderer and its options."""
    from render.registry import names
    from render.replay import FORCES

    add_input(parser, "model", metavar="MODEL", help="folder of a model, or a scene")
    add_input(parser, "recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    add_output(parser, "-o", "--output", kind=FORCES, metavar="FORCES.csv", help="write the forces")
    parser.add_argument("--renderer", choices=names(), default="fem", help="what answers (default: fem)")
    add_options_of(parser, "replay")
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Replay, write, compare with the measured force."""
    options = given_for(arguments, "replay")
    result = api.replay(arguments.model, arguments.recording, arguments.renderer, **options)
    if arguments.output:
        result.save(arguments.output)
    say(arguments, *result.lines())
    emit_json(result.as_json(), arguments.json)
    return 0
