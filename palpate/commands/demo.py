"""The main job on the embedded example, or on a recording of yours.

Reconstructs it, precomputes, replays the recorded path, runs the 1 kHz loop against a simulated hand and
diagnoses; then writes one self-contained HTML report and prints its path. Where there is a screen, the touch
window opens at the end.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

from mechanics.files import check_target, sole_writer
from mechanics.model_files import MODEL
from palpate.arguments import (
    add_input,
    add_json,
    add_options,
    add_seed,
    emit_json,
    options_from,
    progress_bar,
    say,
)
from palpate.demo import DemoOptions, run_demo

SUMMARY = "the main job on the embedded example; prints the report's path"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where from, where to, and the options."""
    add_input(parser, "recording", nargs="?", help="a recording (default: the embedded silicone cylinder)")
    parser.add_argument(
        "-o", "--output", default="palpate-demo", help="folder for model and report (default: %(default)s)"
    )
    parser.add_argument(
        "--window",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="open the touch window at the end (default: where there is a screen and a terminal)",
    )
    add_options(parser, DemoOptions)
    add_seed(parser)
    add_json(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run the demo."""
    folder = Path(arguments.output)
    check_target(folder / "model", MODEL)
    with sole_writer(folder):
        _run(arguments, folder)
    if arguments.window or (arguments.window is None and _has_screen()):
        from palpate.cli import main

        return main(["touch", str(folder / "model"), "--device", "mouse"])
    return 0


def _run(arguments: argparse.Namespace, folder: Path) -> None:
    from scenes.build import keep
    from scenes.embedded import embedded_recording
    from scenes.scene import FOLDER, read_scene

    source = arguments.recording or embedded_recording()
    result = run_demo(source, folder, options_from(arguments, DemoOptions), progress_bar, arguments.seed)
    report = result.report(folder / "report.html")
    if not arguments.recording:
        # 'palpate touch' opens at once; by its file, as a folder of that name would go before it
        keep(read_scene(FOLDER / "demo.toml"), folder / "model")
    say(
        arguments,
        *result.lines(),
        f"report: {report.resolve()}",
        f"to feel it: palpate touch {folder / 'model' if arguments.recording else ''}".rstrip(),
    )
    emit_json({**result.as_json(), "report": str(report.resolve())}, arguments.json)


def _has_screen() -> bool:
    if not sys.stdout.isatty():
        return False
    if sys.platform == "linux":
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True
