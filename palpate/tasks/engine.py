"""Which executor, and a run with a bar."""

from __future__ import annotations

import shutil
import sys
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

from mechanics.errors import OptionError
from mechanics.progress import Progress
from palpate.tasks.driver import Outcome, Status, run
from palpate.tasks.graph import Graph


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
        from palpate.tasks.cluster import DaskExecutor

        return DaskExecutor(scheduler)
    from palpate.tasks.local import LocalExecutor

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
    """`driver.run` on the executor that is wanted; progress: a bar where standard error is a terminal, or a
    function of words and the share that is done."""
    from tqdm import tqdm

    with (
        executor(workers, scheduler, memory_bytes) as chosen,
        tqdm(
            total=100.0,
            disable=progress is not True or not sys.stderr.isatty(),
            bar_format="{percentage:3.0f}% {bar:20} {elapsed} {desc}",
        ) as bar,
    ):

        def tell(status: Status) -> None:
            words, share = status.words(), status.fraction
            if callable(progress):
                progress(words, share)
            bar.set_description_str(words[: max(10, shutil.get_terminal_size().columns - 36)], refresh=False)
            bar.n = 100.0 * share
            bar.refresh()

        return run(graph, chosen, root, force=force, tell=tell, outcomes=outcomes)
