"""What runs every command: parse, look at the paths, do it, ask what is unclear."""

from __future__ import annotations

import argparse
import contextlib
import importlib
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from palpate.logs import set_level
from palpate.mechanics.disk.scratch import sweep_scratch
from palpate.mechanics.disk.writing import FolderKind, Kind, check_target, written_at
from palpate.mechanics.errors import OptionError, PalpateError, RecordingError
from palpate.mechanics.names import pairs
from palpate.operations._call import Call
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
    set_level(given.pop("log_level", "warning"))
    operation, _ = command_operation(name)
    while True:
        call = Call(command=name, out=out)
        try:
            return call.answer(operation.run(given, call))
        except RecordingError as error:
            given = _answered(error, given, operation, out)


def _answered(error: RecordingError, given: Mapping[str, Any], operation: Operation, out: Output) -> Any:
    """What was given, with the answer of a person at a terminal to what is unclear; raises the error where
    nothing can be asked."""
    from palpate.importing.meaning import Unclear

    terminal = out.destination != "-" and sys.stdin.isatty() and sys.stderr.isatty()
    if not (isinstance(error, Unclear) and error.option in operation.fields and terminal):
        raise error
    answer = _typed(error)
    if error.option == "units":
        kind, _, unit = answer.partition("=")
        answer = {**dict(pairs(given.get("units"), "--units", "position=mm")), kind: unit}
    return {**given, error.option: answer}


def _typed(unclear: Any) -> Any:
    """What is typed, until it is allowed; a number where there are no choices."""
    allowed = f" ({' or '.join(unclear.choices)})" if unclear.choices else ""
    while True:
        print(f"{unclear.question}{allowed}? ", end="", file=sys.stderr, flush=True)
        text = sys.stdin.readline()
        if not text:
            raise unclear
        text = text.strip()
        if text in unclear.choices:
            return text
        if not unclear.choices:
            try:
                return float(text)
            except ValueError:
                continue


def check_paths(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Before any work: no output is an input or another output, and each can be written (check_target); of a
    folder that gives way it is said."""
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
    for path, target in targets:
        check_target(path, target)
        if isinstance(target, FolderKind) and path.is_dir() and any(path.iterdir()):
            print(f"{parser.prog}: {path} is there, and what it holds is replaced", file=sys.stderr)


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
