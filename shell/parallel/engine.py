"""Which executor, and a run with a bar."""

from __future__ import annotations

import contextlib
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from palpate.mechanics.errors import OptionError
from palpate.mechanics.progress import Progress, silent
from palpate.output import progress_bar
from palpate.parallel.driver import Outcome, Status, run
from palpate.parallel.graph import Graph


def executor(
    workers: int | None = None, scheduler: str | None = None, memory_bytes: int | None = None
) -> AbstractContextManager[Any]:
    """Processes of this machine, or the workers of a Dask scheduler; leaving the block ends what runs.

    Raises OptionError for fewer workers than one, for both at once, and where no scheduler answers.
    """
    if scheduler is not None and (workers is not None or memory_bytes is not None):
        raise OptionError("a scheduler's workers are its own: give --scheduler, or --workers and --memory")
    if workers is not None and workers < 1:
        raise OptionError(f"--workers {workers}: allowed are 1 and more")
    if memory_bytes is not None and not memory_bytes > 0:
        raise OptionError("--memory must be greater than 0")
    if scheduler is not None:
        from palpate.parallel.cluster import DaskExecutor

        return DaskExecutor(scheduler)
    from palpate.parallel.local import LocalExecutor

    return LocalExecutor(workers, memory_bytes)


def run_with_bar(
    graph: Graph,
    root: Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    memory_bytes: int | None = None,
    force: bool = False,
    progress: bool | Progress = True,
    outcomes: dict[str, Outcome] | None = None,
) -> dict[str, Outcome]:
    """`driver.run` on the executor that is wanted; progress: shown on standard error, or a function of words
    and the share that is done."""
    with executor(workers, scheduler, memory_bytes) as chosen, contextlib.ExitStack() as shown:
        told = progress if callable(progress) else silent
        if progress is True:
            told = shown.enter_context(progress_bar("", left=False))  # the words say it

        def tell(status: Status) -> None:
            told(status.words(), status.fraction)

        return run(graph, chosen, root, force=force, tell=tell, outcomes=outcomes)
