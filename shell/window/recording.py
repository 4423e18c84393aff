"""A session's recording: what the servo recorded, with what is known of the object it was made on."""

from __future__ import annotations

from collections.abc import Mapping as MappingType
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import write_recording
from palpate.servo import Servo
from palpate.servo.recorder import Recorder
from palpate.window.base_tracing import BaseTracing
from palpate.words import mm

MARGIN_S = 0.05


class SessionRecording:
    """Runs from when it is made; `collect` at every frame, `write` once."""

    def __init__(self, servo: Servo, model: Model, path: Path) -> None:
        self.path = path
        self._servo = servo
        self._model = model
        self._recorder = Recorder(servo)
        self._tracing = BaseTracing(model)
        self._first: int | None = None
        self._last = 0

    def _seconds(self, tick: int) -> float:
        """Of the recording, at a tick."""
        return 0.0 if self._first is None else (tick - self._first) * self._servo.options.period_ns * 1e-9

    @property
    def seconds(self) -> float:
        """How long it runs."""
        return self._seconds(self._last)

    @property
    def traced(self) -> float:
        """The share of the way around the base that was traced on the support."""
        return self._tracing.share

    @property
    def words(self) -> str:
        """How much of the way around the base was traced on the support, and why not more."""
        off = self._tracing.off_m
        why = f": {mm(off, '.0f')} beside the foot, lean against it" if off else ""
        return f"base traced {100 * self.traced:.0f} %{why}"

    def collect(self) -> None:
        """Take over what the servo's ring holds."""
        rows = self._recorder.collect()
        rows = rows[np.isfinite(rows["tip"]).all(axis=1)]
        if len(rows):
            self._first = int(rows["tick"][0]) if self._first is None else self._first
            self._last = int(rows["tick"][-1])
            self._tracing.add(rows["tip"], rows["tick"])

    def write(self, title: str, rendered: MappingType[str, Any]) -> Path:
        """Write it; rendered: what was felt at the end, as it stands in [truth].

        Where the base was traced, the recording states when; else the model's own base stands in.
        """
        self.collect()
        recording = self._recorder.recording(self._servo.tip_radius_m, title)
        base, phase = self._model.path, None
        first, last = self._tracing.first, self._tracing.last
        if self._tracing.done and first is not None and last is not None:
            start, end = self._seconds(first), self._seconds(last)
            base, phase = None, (round(max(0.0, start - MARGIN_S), 3), round(end + MARGIN_S, 3))
        recording = replace(
            recording,
            poisson_ratio=self._model.material.poisson_ratio,
            base_model=None if base is None else base.resolve(),
            boundary_phase=phase,
        )
        truth = dict(rendered)
        if self._servo.options.loosened:
            truth["protection_loosened"] = list(self._servo.options.loosened)
        return write_recording(self.path, recording, truth=truth)
