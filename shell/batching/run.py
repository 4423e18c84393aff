"""All of a batch: find, plan, do, and write what came out beside the recordings' folders."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from palpate.batching.plan import Choice, absolute, find, tasks_of, undescribed
from palpate.batching.summary import Batch, agreements, entry_of, write_csv, write_parquet
from palpate.mechanics.disk.writing import Kind, atomic_file, sole_writer
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.progress import Progress
from palpate.parallel.driver import Outcome
from palpate.parallel.engine import run_with_bar
from palpate.parallel.graph import Graph, Task

_TRACE = Kind("a trace", (b"Traceback",))


def batch(
    sources: Iterable[str | Path],
    out: str | Path,
    choice: Choice,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    memory_bytes: int | None = None,
    force: bool = False,
    progress: bool | Progress = True,
) -> Batch:
    """Do what is not finished of all recordings; the summary is written when the user stops it, too.

    Raises OptionError for sources that lead to nothing and what `parallel.engine.executor` refuses, FileError
    for an output that cannot be written or where another batch writes.
    """
    folder = absolute(out)
    sources = list(sources)
    found = find(sources, folder)
    bad: dict[str, str] = {}
    tasks: dict[str, list[Task]] = {}
    for recording in found:
        try:
            tasks[recording.name] = tasks_of(recording, choice, folder)
        except PalpateError as error:
            bad[recording.name] = " ".join(str(error).split())
    outcomes: dict[str, Outcome] = {}

    def made() -> Batch:
        entries = []
        for recording in found:
            own = tasks.get(recording.name, [])
            ended = {task.stage: outcomes[task.name] for task in own if task.name in outcomes}
            entries.append(entry_of(recording.name, ended, bad.get(recording.name), choice.steps))
        reused = sum(outcome.reused for outcome in outcomes.values())
        planned = sum(map(len, tasks.values()))
        agreeing = tuple(agreements(entries))
        return Batch(folder, tuple(entries), agreeing, planned, reused, steps=tuple(choice.steps))

    graph = Graph(task for own in tasks.values() for task in own)
    with sole_writer(folder):
        try:
            run_with_bar(
                graph,
                folder,
                workers=workers,
                scheduler=scheduler,
                memory_bytes=memory_bytes,
                force=force,
                progress=progress,
                outcomes=outcomes,
            )
        except KeyboardInterrupt:
            _write(made())
            raise
        whole = replace(made(), undescribed=tuple(undescribed(sources, folder)))
        _write(whole)
    return whole


def _write(made: Batch) -> None:
    for entry in made.entries:
        log = made.folder / entry.row.recording / "error.txt"
        if entry.trace:
            with atomic_file(log, _TRACE) as temporary:
                temporary.write_text(entry.trace, encoding="utf-8")
        else:
            log.unlink(missing_ok=True)
    write_csv(made.folder / "summary.csv", made.rows)
    write_parquet(made.folder / "summary.parquet", made.rows)
    made.report(made.folder / "index.html")
