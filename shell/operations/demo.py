"""The main job on the embedded example, or on a recording of yours.

Reconstructs it, precomputes, replays the recorded path, runs the 1 kHz loop against a simulated hand and
diagnoses; then writes one self-contained HTML report and prints its path. Where there is a screen, the touch
window opens at the end.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from palpate.demo import DemoOptions, DemoResult, run_demo
from palpate.mechanics.disk.writing import check_target, sole_writer
from palpate.mechanics.model.files import MODEL
from palpate.operations._call import Call
from palpate.operations._declare import argument, operation, option
from palpate.operations._shared import Seed

MEANWHILE = "what this makes is there to be touched already: 'palpate touch' in another terminal"


@operation(common="seconds renderer diagnosis fast", progress=False)
def demo(
    recording: Annotated[
        str | None,
        argument("a recording; None: the embedded silicone cylinder", metavar="REC", reads=True, count="?"),
    ] = None,
    *,
    folder: Annotated[
        str, option("folder for model and report", flag="--output", short="-o", metavar="FOLDER")
    ] = "palpate-demo",
    window: Annotated[
        bool | None, option("open the touch window at the end; None: where there is a screen and a terminal")
    ] = None,
    seed: Seed = 0,
    options: DemoOptions,
    call: Call,
) -> DemoResult:
    """Do all of it, and write the report."""
    from palpate.operations._run import run_command
    from palpate.scenes.embedded import embedded_recording
    from palpate.scenes.kept import keep
    from palpate.scenes.scene import FOLDER, read_scene

    into = Path(folder)
    check_target(into / "model", MODEL)
    if not recording and sys.stderr.isatty():  # as a bar is shown: elsewhere errors alone stand there
        print(MEANWHILE, file=sys.stderr)
    with sole_writer(into):
        source = recording or embedded_recording()
        result = run_demo(source, into, options, seed)
        report = result.report(into / "report.html").resolve()
        if not recording:
            # 'palpate touch' opens at once; by its file, as a folder of that name would go before it
            keep(read_scene(FOLDER / "demo.toml"), into / "model")
    call.then(f"report: {report}")
    call.figures = {"report": str(report)}
    if window or (window is None and _has_screen()):
        call.exit_code = lambda: run_command("touch", [str(into / "model"), "--device", "mouse"])
    return result


def _has_screen() -> bool:
    from palpate.show.scenery import no_screen

    return sys.stdout.isatty() and not no_screen()
