"""The command line generated from options dataclasses, and the arguments that commands share."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
import math
import os
import re
import sys
import types
import typing
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, ClassVar, NoReturn, Protocol, Self, TypeVar

import numpy as np

from mechanics.errors import OptionError, PalpateError
from mechanics.files import JSON, FolderKind, Kind, atomic_file, check_target, written_at
from mechanics.options import check_range
from mechanics.recording import recording_files
from palpate.keywords import kinds, options


class Options(Protocol):
    """Any options dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


T = TypeVar("T", bound=Options)


_DEFAULT = re.compile(r" *\(default: ([^()]*(?:\([^()]*\)[^()]*)*)\)")
_UNIT = re.compile(r" *\[([^\[\]]{1,9})\](?=$| \()")
_NONE = re.compile(r"[;,] (?:None:|default:|'' for|'' means|'' keeps) (.*)$")
_SAID = {"": "", "None": "", "True": "yes", "False": "no"}


def told_help(text: str) -> str:
    """The words of an option in the one order of all: what it is, [unit], (default: ...); no default that
    says nothing, and none that only Python has."""
    default = _DEFAULT.search(text)
    unit = _UNIT.search(text)
    words = _UNIT.sub("", _DEFAULT.sub("", text)).strip()
    value = _SAID.get(default[1], default[1]) if default else ""
    meant = _NONE.search(words)
    if meant and not value:
        words, value = words[: meant.start()], meant[1]
    parts = [words, f"[{unit[1]}]" if unit else "", f"(default: {value})" if value else ""]
    return " ".join(part for part in parts if part)


class HelpWords(argparse.RawDescriptionHelpFormatter):
    """Help in the order of `told_help`; a value that is called after its unit is a NUMBER."""

    def _metavar_formatter(self, action: argparse.Action, default_metavar: str) -> Any:
        unit = _UNIT.search(action.help or "")
        if unit and action.metavar == unit[1].upper():
            return lambda size: ("NUMBER",) * size
        return super()._metavar_formatter(action, default_metavar)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        return told_help(action.help) if action.help else action.help


class OneLineParser(argparse.ArgumentParser):
    """Wrong words are an OptionError, which the command line prints in one line; help is `HelpWords`."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**{"formatter_class": HelpWords, **keywords})

    def error(self, message: str) -> NoReturn:
        """Raise it."""
        raise OptionError(f"{message}; '{self.prog} --help' tells all options")


def add_options(parser: argparse.ArgumentParser, kind: type, *, skip: Sequence[str] = ()) -> None:
    """Add one flag a field of the options dataclass `kind`, with its help, unit and default."""
    group = parser.add_argument_group(kind.__name__.removesuffix("Options").lower() + " options")
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        if field.name in skip or "help" not in field.metadata:
            continue
        meta = field.metadata
        flag, *others = flags_of(field)
        unit = f" [{meta['unit']}]" if meta["unit"] else ""
        text = f"{meta['help']}{unit} (default: {field.default})".replace("%", "%%")
        keywords: dict[str, Any] = {"dest": field.name, "default": argparse.SUPPRESS, "help": text}
        base = _base_type(hints[field.name])
        if base is bool:
            keywords["action"] = argparse.BooleanOptionalAction
        else:
            keywords["type"] = _ranged(field, base) if base in (int, float) else base
            if meta["choices"]:
                keywords["choices"] = meta["choices"]
            else:
                keywords["metavar"] = _METAVARS.get(base, "TEXT")
        group.add_argument(flag, **keywords)
        for other in others:
            group.add_argument(other, **{**keywords, "help": argparse.SUPPRESS})


_METAVARS = {int: "INTEGER", float: "NUMBER", str: "TEXT"}


def flags_of(field: dataclasses.Field[Any]) -> list[str]:
    """The flag that help shows, whose unit stands beside it and not in it, and one that is taken as well."""
    if field.metadata["flag"]:
        return [field.metadata["flag"]]
    whole = "--" + field.name.replace("_", "-")
    unit = field.metadata["unit"].lower().replace("/", " per ").replace(" ", "-").replace("--", "-")
    short = whole.removesuffix(f"-{unit}") if unit else whole
    return [short] if short == whole else [short, whole]


def _ranged(field: dataclasses.Field[Any], base: type) -> Callable[[str], Any]:
    """argparse type: a number that the option takes."""

    def number(text: str) -> Any:
        value = base(text)
        try:
            check_range(field, value, f"'{text}'")
        except OptionError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        return value

    number.__name__ = base.__name__
    return number


def options_from(arguments: argparse.Namespace, kind: type[T], **overrides: Any) -> T:
    """The options dataclass with what the command line gave; fields not given keep their defaults."""
    given = {
        f.name: getattr(arguments, f.name) for f in dataclasses.fields(kind) if hasattr(arguments, f.name)
    }
    return kind(**{**given, **overrides})


def add_options_of(parser: argparse.ArgumentParser, function: str, *, skip: Sequence[str] = ()) -> None:
    """Add the flags of a function of the door (palpate.keywords): `given_for` reads them."""
    for kind in kinds(function):
        add_options(parser, kind, skip=skip)


def given_for(arguments: argparse.Namespace, function: str) -> dict[str, Any]:
    """What the command line gave of a function's options, as its keywords."""
    names = (option.name for option in options(function))
    return {name: getattr(arguments, name) for name in names if hasattr(arguments, name)}


def _base_type(hint: Any) -> type:
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        kinds = [k for k in typing.get_args(hint) if k is not type(None)]
        return _base_type(kinds[0])
    return hint if isinstance(hint, type) else str


def finite(text: str) -> float:
    """argparse type: a finite float, and one whose square is finite too."""
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    if abs(value) > _GREATEST:
        raise argparse.ArgumentTypeError(f"'{text}' is beyond any quantity here (in SI units, {_GREATEST:g})")
    return value


_GREATEST = 1e15


def natural(text: str) -> int:
    """argparse type: a whole number, 0 or greater."""
    value = int(text)
    if not 0 <= value < 1 << 63:
        raise argparse.ArgumentTypeError(f"'{text}' must be a whole number, 0 or greater")
    return value


def vector(text: str) -> np.ndarray:
    """argparse type: three finite numbers, 'X,Y,Z'."""
    parts = text.split(",")
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"'{text}' must be three numbers X,Y,Z")
    return np.array([finite(p) for p in parts])


def add_input(parser: argparse.ArgumentParser, *flags: str, **keywords: Any) -> None:
    """Add an argument that names a file or folder to be read: no output may be the same."""
    setattr(parser.add_argument(*flags, **keywords), _READS, True)


def add_output(
    parser: argparse.ArgumentParser, *flags: str, kind: Kind | FolderKind, **keywords: Any
) -> None:
    """Add an argument that names a file or folder to be written.

    Before the command runs, `check_paths` sees whether it can be, and would replace nothing of another kind.
    """
    setattr(parser.add_argument(*flags, **keywords), _WRITES, kind)


def add_model_output(parser: argparse.ArgumentParser) -> None:
    """Add -o MODEL, the folder of the model to write."""
    from mechanics.model_files import MODEL

    add_output(
        parser, "-o", "--output", kind=MODEL, metavar="MODEL", required=True,
        help="folder of the model to write",
    )  # fmt: skip


_READS, _WRITES = "palpate_reads", "palpate_writes"


def check_paths(parser: argparse.ArgumentParser, arguments: argparse.Namespace) -> None:
    """Before any work: no output is an input or another output, and each can be written (check_target)."""
    read: dict[str, str] = {}
    written: dict[str, str] = {}
    targets: list[tuple[Path, Kind | FolderKind]] = []
    for action in parser._actions:
        given = getattr(arguments, action.dest, None)
        flag = action.option_strings[-1] if action.option_strings else str(action.metavar or action.dest)
        kind = getattr(action, _WRITES, None)
        for each in given if isinstance(given, list) else [given]:
            if each is None or str(each) in ("-", "none"):
                continue
            if hasattr(action, _READS):
                read |= {_identity(file): flag for file in _files_of(Path(each))}
            if kind is not None:
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
    for path, kind in targets:
        check_target(path, kind)


def _files_of(path: Path) -> list[Path]:
    """What is read where `path` is named: both files of a recording, a folder with all in it."""
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


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json PATH`."""
    add_output(
        parser, "--json", kind=JSON, metavar="PATH",
        help="write the result as JSON; '-' for standard output alone",
    )  # fmt: skip


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Add `--seed N`."""
    parser.add_argument("--seed", type=natural, default=0, help="seed of every random choice (default: 0)")


def plain(value: Any) -> Any:
    """A value that JSON can hold: arrays as lists, numbers that are not finite as null."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return plain(dataclasses.asdict(value))
    if isinstance(value, dict) or hasattr(value, "items"):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(v) for v in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def emit_json(value: Any, destination: str | None) -> None:
    """Write `value` as JSON to a file, or to standard output for '-'; nothing for None."""
    if destination is None:
        return
    text = json.dumps(plain(value), indent=1)
    if destination == "-":
        print(text)
        return
    with atomic_file(destination, JSON) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def say(arguments: argparse.Namespace, *lines: str) -> None:
    """Print lines for a person, unless standard output belongs to JSON."""
    if getattr(arguments, "json", None) != "-":
        print(*lines, sep="\n")


def progress_bar(label: str) -> Bar:
    """A `mechanics.progress.Progress` that draws a bar on stderr when that is a terminal; call `.close()`."""
    return Bar(label)


class Bar:
    """See `progress_bar`; also a context manager, which closes it."""

    def __init__(self, label: str) -> None:
        from tqdm import tqdm

        self._bar = tqdm(
            total=100.0,
            desc=label,
            disable=not sys.stderr.isatty(),
            bar_format="{desc:<34.34} {bar:24} {percentage:3.0f}% {elapsed}",
            leave=True,
        )
        self._label = label

    def __call__(self, stage: str, fraction: float) -> None:
        self._bar.set_description_str(f"{self._label}: {stage}", refresh=False)
        self._bar.n = 100.0 * min(max(fraction, 0.0), 1.0)
        self._bar.refresh()

    def close(self) -> None:
        """Finish the bar's line."""
        self._bar.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
