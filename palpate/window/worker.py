"""One thread for what takes longer than a frame."""

from __future__ import annotations

import threading
from collections.abc import Callable

from mechanics.errors import PalpateError


class Worker:
    """Runs one job at a time; a request that comes meanwhile is dropped.

    busy: what is being done, in words, '' for nothing. failure: why the last job failed, '' where it did not.
    """

    def __init__(self) -> None:
        self.busy = ""
        self.failure = ""
        self._thread: threading.Thread | None = None

    def run(self, words: str, job: Callable[[], None]) -> bool:
        """Begin a job; False where one is still running."""
        if self._thread is not None and self._thread.is_alive():
            return False

        def work() -> None:
            try:
                job()
                self.failure = ""
            except PalpateError as error:
                self.failure = str(error)
            except Exception as error:
                self.failure = f"{type(error).__name__}: {error}"
                raise
            finally:
                self.busy = ""

        self.busy = words
        self._thread = threading.Thread(target=work, name="touch worker", daemon=True)
        self._thread.start()
        return True

    def wait(self) -> None:
        """Until the job is done."""
        if self._thread is not None:
            self._thread.join()
