"""The main job in one go: reconstruct, precompute, replay, feel for ten seconds, diagnose; then a report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mechanics.model import Model
from mechanics.model_files import write_model
from mechanics.options import option
from mechanics.progress import Progress
from mechanics.recording import Recording, read_recording
from mechanics.result import Result
from palpate.servo.report import ServoReport
from palpate.warm_up import warming_up
from reconstruct.pipeline import Reconstruction

if TYPE_CHECKING:
    from diagnose.verdict.result import Diagnosis


@dataclass(frozen=True)
class DemoOptions:
    """What a person may want otherwise."""

    seconds: float = option(10.0, "how long the 1 kHz loop runs against the simulated hand", unit="s")
    renderer: str = option("fem", "which renderer serves the loop and the replay")
    diagnosis: bool = option(True, "diagnose the gap too, in its fast form", flag="--diagnosis")


@dataclass(frozen=True, eq=False, repr=False)
class DemoResult(Result):
    """Everything that the report shows.

    rendered_n: (n, 3) N, force on the tool along the recorded path. replay_rmse_n, contact_force_rms_n: N,
    rms of the error and of the measured force over the contact samples. seconds: wall time of each stage.
    """

    recording: Recording
    reconstruction: Reconstruction
    rendered_n: np.ndarray
    replay_rmse_n: float
    contact_force_rms_n: float
    servo: ServoReport
    diagnosis: Diagnosis | None
    seconds: dict[str, float]

    @property
    def model(self) -> Model:
        """The reconstructed model."""
        return self.reconstruction.model


def run_demo(
    source: Path | str,
    folder: Path,
    options: DemoOptions,
    bar: Callable[[str], AbstractContextManager[Progress]],
    seed: int = 0,
) -> DemoResult:
    """Do all of it; the model goes to `folder/model`. `bar(label)` makes a progress bar for a stage."""
    import render
    from mechanics.compliance import load_or_condense
    from palpate.servo.headless import run_headless
    from reconstruct.pipeline import ReconstructOptions, reconstruct_fully
    from render.felt import with_own_stiffness
    from render.replay import replay_recording, rms_n

    seconds: dict[str, float] = {}

    @contextmanager
    def stage(label: str) -> Iterator[Progress]:
        start = time.perf_counter()
        with bar(label) as progress:
            yield progress
            progress("done", 1.0)
        seconds[label] = time.perf_counter() - start

    recording = read_recording(source)
    with warming_up() as compiling, stage("reconstruct") as progress:
        done = reconstruct_fully(recording, ReconstructOptions(seed=seed), progress)
        path = write_model(folder / "model", done.model)
        done = replace(done, model=done.model.replaced(path=path))
        model = done.model
        progress("compiling", 0.99)
        compiling()
    with stage("precompute") as progress:
        load_or_condense(model, progress=progress)
        renderer = render.create(options.renderer, model, progress=progress)
        with_own_stiffness(renderer)
    with stage("replay") as progress:
        rendered = replay_recording(renderer, recording, progress)
        touching = model.presses.touching(recording.t)
        error = rms_n((rendered - recording.force_on_tool)[touching])
        whole = rms_n(recording.force_on_tool[touching])
    with stage("feel at 1 kHz") as progress:
        servo = run_headless(model, options.renderer, seconds=options.seconds, seed=seed, progress=progress)
    diagnosis = None
    if options.diagnosis:
        from diagnose.options import DiagnoseOptions
        from diagnose.pipeline import diagnose

        with stage("diagnose") as progress:
            diagnosis = diagnose(recording, model, DiagnoseOptions(fast=True, seed=seed), progress)
    return DemoResult(recording, done, rendered, error, whole, servo, diagnosis, seconds)
