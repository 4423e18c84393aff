"""A recording for other programs, with what a model says of it: what its writers share."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording


@dataclass(frozen=True)
class Recorded:
    """model: None where none was given; rendered_n: (n, 3) N, its force on the tool along the recorded path;
    contact: (n,) bool, the samples that count (the model has no support)."""

    recording: Recording
    model: Model | None = None
    rendered_n: np.ndarray | None = None
    contact: np.ndarray | None = None

    @cached_property
    def depth_m(self) -> np.ndarray | None:
        """(n,) m, travel against the normal since first touch, 0 in the air; None without a model that was
        made of this recording."""
        if self.model is None or self.model.presses.recording != self.recording.content:
            return None
        presses, deep = self.model.presses, np.zeros(len(self.recording.t))
        for onset, end, normal in zip(presses.onset_s, presses.end_s, presses.normal, strict=True):
            first, last = np.searchsorted(self.recording.t, (onset, end))
            path = self.recording.position[first : last + 1]
            deep[first : last + 1] = np.maximum((path[0] - path) @ normal, 0.0)
        return deep

    @property
    def residual_n(self) -> np.ndarray | None:
        """(n, 3) N, measured less rendered; nan where the model does not count."""
        if self.rendered_n is None or self.contact is None:
            return None
        left = self.recording.force_on_tool - self.rendered_n
        return np.where(self.contact[:, None], left, np.nan)

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not in the file, and why."""
        if self.model is None:
            return ("no depth, and no force of a model: --model MODEL gives them",)
        return () if self.depth_m is not None else ("no depth: the model was made of another recording",)
