"""The main job on the embedded example, or on a recording of yours.

Reconstructs it, precomputes, replays the recorded path, runs the 1 kHz loop against a simulated hand and
diagnoses; then writes one self-contained HTML report and prints its path. Where there is a screen, the touch
window opens at the end.
"""

from __future__ import annotations

import os
import sys
from dataclasses import KW_ONLY, dataclass
from pathlib import Path

from palpate.demo import DemoOptions, DemoResult, run_demo
from palpate.mechanics.disk.writing import check_target, sole_writer
from palpate.mechanics.model.files import MODEL
from palpate.operations._declare import Call, operand, operation
from palpate.operations._shared import recording_operand, seed_operand
from palpate.output import Output

MEANWHILE = "what this makes is there to be touched already: 'palpate touch' in another terminal"


@dataclass(frozen=True)
class DemoOperands:
    """Where from, where to."""

    recording: str | None = recording_operand(
        None, "a recording; None: the embedded silicone cylinder", count="?"
    )
    _: KW_ONLY
    folder: str = operand(
        "palpate-demo", "folder for model and report", flag="--output", short="-o", metavar="FOLDER"
    )
    window: bool | None = operand(
        None, "open the touch window at the end; None: where there is a screen and a terminal"
    )
    seed: int = seed_operand()


def _answer(found: tuple[DemoResult, Path], asked: DemoOperands, out: Output) -> int:
    from palpate.show import next_lines

    result, report = found
    at = Path(asked.folder) / "model"
    out.say(
        *result.lines(),
        f"report: {report.resolve()}",
        *next_lines(result),
    )
    out.json({**result.as_json(), "report": str(report.resolve())})
    if asked.window or (asked.window is None and _has_screen()):
        from palpate.operations._run import run_command

        return run_command("touch", [str(at), "--device", "mouse"])
    return 0


@operation(DemoOperands, DemoOptions, often="seconds renderer diagnosis fast", answer=_answer, progress=False)
def demo(asked: DemoOperands, call: Call) -> tuple[DemoResult, Path]:
    """Do all of it, and write the report; what was found, and where it is written."""
    from palpate.scenes.build import keep
    from palpate.scenes.embedded import embedded_recording
    from palpate.scenes.scene import FOLDER, read_scene

    folder = Path(asked.folder)
    check_target(folder / "model", MODEL)
    if not asked.recording and sys.stderr.isatty():  # as a bar is shown: elsewhere errors alone stand there
        print(MEANWHILE, file=sys.stderr)
    with sole_writer(folder):
        source = asked.recording or embedded_recording()
        result = run_demo(source, folder, call.of(DemoOptions), asked.seed)
        report = result.report(folder / "report.html")
        if not asked.recording:
            # 'palpate touch' opens at once; by its file, as a folder of that name would go before it
            keep(read_scene(FOLDER / "demo.toml"), folder / "model")
    return result, report


def _has_screen() -> bool:
    if not sys.stdout.isatty():
        return False
    if sys.platform == "linux":
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return True
