"""The main job in one go: reconstruct, precompute, replay, feel for some seconds, diagnose."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.compliance.sites import factorised_once
from palpate.mechanics.model.model import Model
from palpate.mechanics.options import option
from palpate.mechanics.progress import Progress
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.result import Result
from palpate.operations.diagnose import AttributionOptions, diagnose
from palpate.operations.read_recording import read_recording
from palpate.operations.reconstruct import reconstruct
from palpate.operations.renderer import renderer
from palpate.operations.replay import replay
from palpate.output import progress_bar
from palpate.reconstruction.pipeline import Reconstruction
from palpate.servo.headless import run_headless
from palpate.servo.report import ServoReport
from palpate.warm_up import warming_up

if TYPE_CHECKING:
    from palpate.diagnosis.verdict.result import Diagnosis


@dataclass(frozen=True)
class DemoOptions:
    """What a person may want otherwise."""

    seconds: float = option(3.0, "how long the 1 kHz loop runs against the simulated hand", unit="s")
    renderer: str = option("fem", "which renderer serves the loop and the replay")
    diagnosis: bool = option(True, "diagnose the gap too", flag="--diagnosis")
    fast: bool = option(True, "by fewer effects")


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


def run_demo(source: Path | str, folder: Path, options: DemoOptions, seed: int = 0) -> DemoResult:
    """Do all of it; the model goes to `folder/model`."""
    from palpate.diagnosis.verdict.result import Diagnosis

    seconds: dict[str, float] = {}

    @contextmanager
    def stage(label: str) -> Iterator[Progress]:
        start = time.perf_counter()
        with progress_bar(label) as progress:
            yield progress
            progress("done", 1.0)
        seconds[label] = time.perf_counter() - start

    recording = read_recording(source)
    diagnosis = None
    with warming_up() as compiling, factorised_once():  # one mesh is solved on by three stages
        with stage("reconstruct") as progress:
            done = reconstruct(recording, save=folder / "model", seed=seed, progress=progress)
            model = done.model
        with stage("precompute") as progress:
            rendering = renderer(model, options.renderer, progress=progress)
        if options.diagnosis:  # needs nothing of what another core still compiles
            with stage("diagnose") as progress:
                most = AttributionOptions().greatest_number
                found = diagnose(recording, model, fast=options.fast, most=most, seed=seed, progress=progress)
                diagnosis = found if isinstance(found, Diagnosis) else None  # no simulator was named
        with stage("replay") as progress:
            progress("compiling", 0.0)
            compiling()
            replayed = replay(rendering, recording, progress=progress)
    with stage("feel at 1 kHz") as progress:
        servo = run_headless(model, options.renderer, seconds=options.seconds, seed=seed, progress=progress)
    return DemoResult(
        recording,
        done,
        replayed.force_n,
        replayed.rmse_n,
        replayed.force_rms_n,
        servo,
        diagnosis,
        seconds,
    )
