"""One thread for what takes longer than a frame.

Which parts of the window are drawn at the next picture: where drawing is slow, what is felt comes first.

A part that is not drawn keeps what it showed, and costs nothing.

What one picture of a session shows.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.errors import PalpateError


class Worker:
    """Runs one job after the other, in the order in which they were asked for.

    busy: what is being done, in words, '' for nothing; share: how much of it. failure: why the last job
    failed, '' where it did not.
    """

    def __init__(self) -> None:
        self.busy = ""
        self.share = 0.0
        self._words = ""
        self.failure = ""
        self._jobs: queue.Queue[tuple[str, Callable[[], None]]] = queue.Queue()
        threading.Thread(target=self._work, name="touch worker", daemon=True).start()

    def run(self, words: str, job: Callable[[], None]) -> None:
        """Do a job, after those that were asked for before."""
        self._jobs.put((words, job))

    def tell(self, stage: str, share: float) -> None:
        """A Progress for the job that runs."""
        self.busy, self.share = f"{self._words}: {stage}", share

    @property
    def idle(self) -> bool:
        """Whether every job is done."""
        return not self._jobs.unfinished_tasks

    def offer(self, words: str, job: Callable[[], None]) -> bool:
        """Do a job at once, which will be offered again where it could not; False while there are others."""
        if not self.idle:
            return False
        self.run(words, job)
        return True

    def _work(self) -> None:
        while True:
            self._words, job = self._jobs.get()
            self.busy, self.share = self._words, 0.0
            try:
                job()
                self.failure = ""
            except PalpateError as error:
                self.failure = str(error)
            except Exception as error:  # the next job must find its worker
                self.failure = f"{type(error).__name__}: {error}"
            finally:
                self.busy = ""
                self._jobs.task_done()

    def wait(self) -> None:
        """Until every job is done."""
        self._jobs.join()


SLOW_S, QUICK_S = 1 / 30, 1 / 50
"""Between pictures: above the first the other parts come less often, below the second as often again."""
WORDS_S = 0.1
_MEMORY = 0.2
_PAUSE_S = 0.5


class Pace:
    """Learns how long a picture takes from how often it is asked."""

    def __init__(self) -> None:
        self._last_s: float | None = None
        self._usual_s = 0.0
        self._slow = False
        self._words_s = float("-inf")
        self._pictures = 0
        self._all = True

    def next(self, now_s: float) -> tuple[bool, bool]:
        """At a picture that begins now: whether the second picture is drawn, and whether words and plots."""
        if self._last_s is not None:
            took = min(now_s - self._last_s, _PAUSE_S)
            self._usual_s += _MEMORY * (took - self._usual_s)
        self._last_s = now_s
        self._slow = self._usual_s > (QUICK_S if self._slow else SLOW_S)
        self._pictures += 1
        everything, self._all = self._all or not self._slow, False
        words = everything or now_s - self._words_s >= WORDS_S
        if words:
            self._words_s = now_s
        return everything or self._pictures % 2 == 0, words

    def forget(self) -> None:
        """All is drawn at the next picture, whatever it costs."""
        self._all = True


def level(up: np.ndarray) -> np.ndarray:
    """(3,) unit vector across a unit vector `up` (3,): from the object away from the person."""
    away = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    return away / np.linalg.norm(away)


@dataclass(frozen=True)
class RendererView:
    """One renderer's side of a frame: force on the tool (3,) N and the surface's displacement (n, 3) m."""

    name: str
    force_n: np.ndarray
    displacement_m: np.ndarray


@dataclass(frozen=True)
class Frame:
    """Of the first tip: tip_m (3,), depth_m in the object, stiffness in N/m, 0 in air.

    reason: why the commanded force is not the rendered one, in plain words. busy: what the worker does, or
    why it failed. recorded_s: how long a recording runs, None without one. table: how far a table is that is
    filled in while it is felt, '' for the whole one.
    """

    time_s: float
    tip_m: np.ndarray
    depth_m: float
    touching: bool
    stiffness_n_per_m: float
    force_enabled: bool
    reason: str
    views: tuple[RendererView, ...]
    busy: str
    recorded_s: float | None
    table: str = ""
