"""The command line generated from options dataclasses, and the arguments that commands share."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import sys
import types
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Protocol, Self, TypeVar

import numpy as np

from mechanics.errors import OptionError
from mechanics.files import atomic_file
from palpate.keywords import kinds, options


class Options(Protocol):
    """Any options dataclass."""

    __dataclass_fields__: ClassVar[dict[str, Any]]


T = TypeVar("T", bound=Options)


def add_options(parser: argparse.ArgumentParser, kind: type, *, skip: Sequence[str] = ()) -> None:
    """Add one flag a field of the options dataclass `kind`, with its help, unit and default."""
    group = parser.add_argument_group(kind.__name__.removesuffix("Options").lower() + " options")
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):
        if field.name in skip or "help" not in field.metadata:
            continue
        meta = field.metadata
        flag = meta["flag"] or "--" + field.name.replace("_", "-")
        unit = f" [{meta['unit']}]" if meta["unit"] else ""
        default = "chosen from the data" if field.default is None else field.default
        text = f"{meta['help']}{unit} (default: {default})".replace("%", "%%")
        keywords: dict[str, Any] = {"dest": field.name, "default": argparse.SUPPRESS, "help": text}
        base = _base_type(hints[field.name])
        if base is bool:
            keywords["action"] = argparse.BooleanOptionalAction
        else:
            keywords["type"] = {int: int, str: str, float: finite}.get(base, base)
            if meta["choices"]:
                keywords["choices"] = meta["choices"]
            else:
                keywords["metavar"] = (meta["unit"] or base.__name__).upper().replace(" ", "_")
        group.add_argument(flag, **keywords)


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
    """argparse type: a finite float."""
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    return value


def vector(text: str) -> np.ndarray:
    """argparse type: three finite numbers, 'X,Y,Z'."""
    parts = text.split(",")
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"'{text}' must be three numbers X,Y,Z")
    return np.array([finite(p) for p in parts])


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add `--json PATH`."""
    parser.add_argument(
        "--json", metavar="PATH", help="write the result as JSON; '-' for standard output alone"
    )


def add_seed(parser: argparse.ArgumentParser) -> None:
    """Add `--seed N`."""
    parser.add_argument("--seed", type=int, default=0, help="seed of every random choice (default: 0)")


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
    with atomic_file(destination) as temporary:
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


def positive(value: float, name: str) -> float:
    """`value`, or OptionError where it is not greater than 0."""
    if not value > 0:
        raise OptionError(f"{name} is {value}; it must be greater than 0")
    return value
