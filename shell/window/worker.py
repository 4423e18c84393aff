"""One thread for what takes longer than a frame."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable

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
