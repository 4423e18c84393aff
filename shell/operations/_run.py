"""What runs every command: parse, look at the paths, do it, say it, write it."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.mechanics.disk.scratch import sweep_scratch
from palpate.mechanics.disk.writing import FolderKind, Kind, check_target, written_at
from palpate.mechanics.errors import OptionError, PalpateError
from palpate.operations._declare import STREAMS, Operation
from palpate.operations._list import OPERATIONS, module_of
from palpate.operations._to_argparse import OneLineParser, add_operation
from palpate.output import Output


def command_operation(name: str) -> tuple[Operation, Any]:
    """(operation, its module) behind a command."""
    module = importlib.import_module(module_of(name))
    return getattr(module, (OPERATIONS[name].calls or name).split()[0]).operation, module


def parser_of(name: str) -> argparse.ArgumentParser:
    """The parser of one command, with all its options."""
    operation, module = command_operation(name)
    parser = OneLineParser(prog=f"palpate {name}", description=module.__doc__)
    add_operation(parser, operation)
    return parser


def run_command(name: str, words: Sequence[str], parser: argparse.ArgumentParser | None = None) -> int:
    """Run a command with the words after its name; the exit code. Raises PalpateError."""
    parser = parser or parser_of(name)
    arguments = parser.parse_args(words)
    check_paths(parser, arguments)
    sweep_scratch()
    given = vars(arguments)
    out = Output(given.pop("json", None))
    operation, _ = command_operation(name)
    asked, result = operation.run(given, out=out)
    return (operation.answer or answer)(result, asked, out)


def answer(
    result: Any,
    asked: Any,
    out: Output,
    *,
    lines: Sequence[str] = (),
    figures: Mapping[str, Any] | None = None,
) -> int:
    """Say a result's lines, save and report it where that was asked for, write its JSON; exit code 0.

    lines: more to say; figures: what goes before the result's own JSON.
    """
    out.say(*result.lines(), *lines)
    output, page = getattr(asked, "output", None), getattr(asked, "report", None)
    if output is not None:
        result.save(output)
        out.say(f"written: {output}")
    if page is not None:
        out.say(report_words(result.report(page)))
    say_next(result, out)
    out.json({**(figures or {}), **result.as_json()})
    return 0


def report_words(page: Path) -> str:
    """Where a page is; and the folder beside it, where its pictures were written as files too."""
    folder = page.with_suffix("")
    also = f" (its pictures as files too: {folder}{os.sep})" if any(folder.glob("*.png")) else ""
    return f"report: {page}{also}"


def say_next(result: Any, out: Output, **more: Any) -> None:
    """Say what to do with a result. more: what its kind's `next_steps` takes beside."""
    from palpate.show import next_lines

    out.say(*next_lines(result, **more))


def check_paths(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Before any work: no output is an input or another output, and each can be written (check_target)."""
    read: dict[str, str] = {}
    written: dict[str, str] = {}
    targets: list[tuple[Path, Kind | FolderKind]] = []
    for action in parser._actions:
        how = getattr(action, "on_command_line", None)
        given = getattr(arguments, action.dest, None)
        flag = action.option_strings[-1] if action.option_strings else str(action.metavar or action.dest)
        for each in given if isinstance(given, list) else [given]:
            if how is None or each is None or str(each) in STREAMS:
                continue
            if how.reads:
                read |= {_identity(file): flag for file in _files_of(Path(each))}
            if (kind := how.kind()) is not None:
                targets.append((Path(each), kind))
                for file, _ in written_at(*targets[-1]):
                    if _identity(file) in written:
                        raise OptionError(
                            f"{flag} and {written[_identity(file)]} both name '{file}': name two"
                        )
                    written[_identity(file)] = flag
    for same in written.keys() & read.keys():
        raise OptionError(
            f"{written[same]} would replace what {read[same]} names and is read from: name another output"
        )
    for target in targets:
        check_target(*target)


def _files_of(path: Path) -> list[Path]:
    """What is read where `path` is named: both files of a recording, a folder with all in it."""
    from palpate.mechanics.recording.files import recording_files

    with contextlib.suppress(PalpateError, OSError):
        return list(recording_files(path))
    with contextlib.suppress(OSError):
        return [path, *path.iterdir()] if path.is_dir() else [path]
    return []


def _identity(path: Path) -> str:
    """The same for every name of a file that is there; else its place."""
    with contextlib.suppress(OSError):
        about = path.stat()
        return f"{about.st_dev}:{about.st_ino}"
    return os.path.realpath(path)
