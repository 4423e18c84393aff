"""A recorded tip path through a renderer, headless: t,fx,fy,fz in s and N, the force on the tool.

The tip starts in the air; contact is found on the model's surface and its support alone, without looking at
the measured force. The same MODEL and REC give bit-identical output. What is printed compares with the
measured force over the contact samples: phase II, from first touch to its loss and 50 ms around.
"""

from __future__ import annotations

import argparse

from palpate.arguments import add_json, add_options, emit_json, options_from, progress_bar, say

SUMMARY = "a recorded tip path through a renderer, headless"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """MODEL, REC, -o, the renderer and its options."""
    from render.options import RenderOptions
    from render.registry import names
    from render.support import SupportOptions

    parser.add_argument("model", metavar="MODEL", help="folder of a model, or a scene")
    parser.add_argument("recording", metavar="REC", help="recording: .csv, .csv.gz or .toml")
    parser.add_argument("-o", "--output", metavar="FORCES.csv", help="write the forces")
    parser.add_argument("--renderer", choices=names(), default="fem", help="(default: fem)")
    add_options(parser, RenderOptions)
    add_options(parser, SupportOptions)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Replay, write, compare with the measured force."""
    import numpy as np

    from mechanics.recording import read_recording
    from palpate.sources import open_scene
    from reconstruct.placing import presses_on
    from render.options import RenderOptions
    from render.replay import replay_error, replay_recording, write_forces
    from render.support import SupportOptions

    recording = read_recording(arguments.recording)
    with progress_bar("replay") as progress:
        scene = open_scene(
            arguments.model,
            arguments.renderer,
            options_from(arguments, RenderOptions),
            options_from(arguments, SupportOptions),
            progress,
        )
        forces = replay_recording(scene, recording, progress)
    if arguments.output:
        write_forces(arguments.output, recording.t, forces)
    error = replay_error(recording, presses_on(recording, scene.model), forces)
    result = {
        "renderer": arguments.renderer,
        "samples": len(forces),
        "contact_samples": int(error.contact.sum()),
        "rmse_n": error.rmse_n,
        "force_rms_n": error.force_rms_n,
        "relative_rmse": error.relative,
        "peak_force_n": float(np.linalg.norm(forces, axis=1).max()),
    }
    noise = recording.force_noise_std_n
    if noise is not None:
        result["noise_n"] = noise * np.sqrt(3.0)
    say(
        arguments,
        f"{arguments.renderer}: error {error.rmse_n:.4g} N rms over {result['contact_samples']} contact "
        f"samples, {100 * error.relative:.3g} % of the measured {error.force_rms_n:.4g} N rms"
        + (f" (sensor noise {result['noise_n']:.3g} N)" if noise is not None else ""),
    )
    emit_json(result, arguments.json)
    return 0
