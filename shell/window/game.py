"""Find the nodule: hidden until the answer, scored by distance and time, one renderer against another.

The clock runs from the first touch. A round's score is 100 for an answer over the nodule in no time, as the
N/m tell no place over it from another: within 1 % they are the same 6.5 mm from its middle, from 2 to 10 mm
deep. It halves with every nodule's radius that the answer is beside it, seen from above, and every
HALF_TIME_S.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.model.material import Ball
from palpate.scenes.scene import FIND_M
from palpate.words import mm, renderer_words

HALF_TIME_S = 150.0
"""What somebody who had never played took."""
PRESSED = 0.9
"""Share of a press's depth from which the tip is where it pressed, and no longer on its way in or out."""
PRESS_M = FIND_M
"""How deep a press goes at first."""


@dataclass(frozen=True)
class Guess:
    """renderer: what was felt. off_m: from the nodule's middle, seen along `up`; beside_m: from its edge, 0
    over it. score: 0 to 100."""

    renderer: str
    off_m: float
    beside_m: float
    seconds: float
    score: float


class Game:
    """Rounds of one scene. hidden: its nodules, in the scene's frame. up: (3,) the support's normal."""

    def __init__(self, hidden: Sequence[Ball], up: np.ndarray) -> None:
        self.hidden = tuple(hidden)
        self.answers: list[Guess] = []
        self._up = np.asarray(up, dtype=float)
        self._started_s: float | None = None
        self._deepest_m = 0.0
        self._place_m = np.zeros(3)
        self._touching = False

    @property
    def answered(self) -> bool:
        """Whether the nodule may be seen; the next touch, from the air, begins the next round."""
        return bool(self.answers) and self._started_s is None

    def follow(self, depth_m: float, tip_m: np.ndarray, now_s: float) -> None:
        """At every picture: how deep in the object the tip is, 0 in air, and where, (3,) m.

        A touch that begins starts the clock, where it does not run.
        """
        touching = depth_m > 0.0
        if touching and not self._touching:
            self._deepest_m = 0.0
            self._started_s = now_s if self._started_s is None else self._started_s
        if depth_m > PRESSED * self._deepest_m:
            self._place_m = np.array(tip_m, dtype=float)
        self._deepest_m = max(self._deepest_m, depth_m)
        self._touching = touching

    def seconds(self, now_s: float) -> float:
        """Since this round's first touch."""
        return 0.0 if self._started_s is None else now_s - self._started_s

    def answer(self, now_s: float, renderer: str) -> Guess | None:
        """The nodule is where the tip pressed last; None where nothing was touched in this round."""
        if self._started_s is None:
            return None
        seconds, self._started_s = now_s - self._started_s, None
        offs = [self._off(self._place_m, ball) for ball in self.hidden]
        nearest = int(np.argmin(offs))
        radius = self.hidden[nearest].radius_m
        beside = max(0.0, offs[nearest] - radius)
        score = 100.0 * 0.5 ** (beside / radius + seconds / HALF_TIME_S)
        self.answers.append(Guess(renderer, offs[nearest], beside, seconds, score))
        return self.answers[-1]

    def _off(self, point_m: np.ndarray, ball: Ball) -> float:
        away = point_m - ball.centre_m
        return float(np.linalg.norm(away - (away @ self._up) * self._up))

    def lines(self, now_s: float) -> list[str]:
        """For the panel: what to do, the last round, and the mean score of each renderer."""
        if self._started_s is not None:
            ran = f"{self.seconds(now_s):.0f} s so far."
            first = (
                "Compare the N/m above. Press last in the middle of where they are most, then click "
                f"'It is here'. {ran}"
            )
        elif self.answers:
            last = self.answers[-1]
            where = f"{mm(last.beside_m, '.1f')} beside the nodule" if last.beside_m else "Over the nodule"
            first = (
                f"{where} after {last.seconds:.0f} s by {renderer_words(last.renderer)}: {last.score:.0f} of "
                f"100 points, halved by its radius beside it and by {HALF_TIME_S:.0f} s. Touch anew to go "
                "on; Tab: next renderer."
            )
        else:
            deep = mm(PRESS_M, "g")
            first = f"A nodule is hidden: press {deep} deep at many places of the upper half."
        names = sorted({a.renderer for a in self.answers})
        scores = [
            f"{renderer_words(name)} "
            f"{np.mean([a.score for a in self.answers if a.renderer == name]):.0f} of 100 points in "
            f"{sum(a.renderer == name for a in self.answers)}"
            for name in names
        ]
        return [first, *([", ".join(scores)] if len(names) > 1 else [])]
