"""One call of an operation, and what its command does with the result."""

from __future__ import annotations

import dataclasses
import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.result import plain
from palpate.output import Output, progress_bar

_LOG = logging.getLogger("palpate").getChild("progress")
Step = str | Callable[[], Sequence[str]]
"""What a command says: a line, or what makes lines when their turn comes."""


@dataclass
class Call:
    """One call of an operation. given: its operands that were given, by name; wanted: whether or where
    progress goes; command: its name on the command line, '' for a Python call; out: what a command says on
    the way, silent in a Python call.

    What a command does with the result comes after: it says the result's lines (unless `said`, on the way),
    then `steps`, then `following` (None: what the result's kind advises), writes the result's JSON with
    `figures`, and ends with `exit_code`, or with what that gives as a function. A Python call does none of
    it.
    """

    wanted: bool | Progress = True
    command: str = ""
    given: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    out: Output = dataclasses.field(default_factory=lambda: Output("-"))
    steps: list[Step] = dataclasses.field(default_factory=list)
    following: Sequence[Step] | None = None
    said: bool = False
    figures: dict[str, Any] = dataclasses.field(default_factory=dict)
    exit_code: int | Callable[[], int] = 0

    def then(self, *steps: Step) -> None:
        """Say this after the result's lines."""
        self.steps += steps

    def then_save(self, result: Any, path: Any) -> None:
        """Save the result after its lines, where that was asked for."""

        def saved() -> list[str]:
            result.save(path)
            return [f"written: {path}"]

        if path is not None:
            self.then(saved)

    def then_report(self, result: Any, page: Any, *more: Any) -> None:
        """Write the result's page after its lines, where one was asked for."""
        if page is not None:
            self.then(lambda: [report_words(result.report(page, *more))])

    @contextmanager
    def progress(self, label: str) -> Iterator[Progress]:
        """Where progress goes: to a callable, to a bar on a terminal, or nowhere."""
        if callable(self.wanted):
            yield _logged(label, self.wanted)
        elif self.wanted:
            with progress_bar(label) as bar:
                yield _logged(label, bar)
        else:
            yield _logged(label, silent)

    def answer(self, result: Any) -> int:
        """What a command does with the result; its exit code. A result says itself by `lines` and `plain`;
        text is its own line, and None is nothing to say."""
        if result is None:
            return 0
        from palpate.schemas import labelled
        from palpate.show import next_lines

        says = hasattr(result, "lines")
        if not self.said:
            self._say(result.lines() if says else [result] if isinstance(result, str) else [])
        self._say(self.steps)
        self._say(next_lines(result) if self.following is None else self.following)
        figures = {**(plain(result) if says else {}), **self.figures}
        self.out.json(labelled(self.command, figures))
        return self.exit_code() if callable(self.exit_code) else self.exit_code

    def _say(self, steps: Sequence[Step]) -> None:
        for step in steps:
            self.out.say(*([step] if isinstance(step, str) else step()))


def _logged(label: str, progress: Progress) -> Progress:
    """The same, which also logs when a stage begins."""
    stages: list[str] = [""]

    def told(stage: str, fraction: float) -> None:
        if stage != stages[-1]:
            stages[0] = stage
            _LOG.info("%s: %s", label, stage)
        progress(stage, fraction)

    return told


def report_words(page: Path) -> str:
    """Where a page is; and the folder beside it, where its pictures were written as files too."""
    folder = page.with_suffix("")
    also = f" (its pictures as files too: {folder}{os.sep})" if any(folder.glob("*.png")) else ""
    return f"report: {page}{also}"
