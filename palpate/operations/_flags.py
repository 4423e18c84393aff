"""The flags and help of a command, from what its operation declares."""

from __future__ import annotations

import argparse
import dataclasses
import math
import re
from collections.abc import Callable
from typing import Any, NoReturn

from mechanics.errors import OptionError
from mechanics.files import JSON
from mechanics.options import check_range, flag_of
from palpate.operations._declare import GREATEST, OnCommandLine, Operation, declared, type_words, written

_DEFAULT = re.compile(r" *\(default: ([^()]*(?:\([^()]*\)[^()]*)*)\)")
_UNIT = re.compile(r" *\[([^\[\]]{1,9})\](?=$| \()")
_NONE = re.compile(r"[;,] (?:None:|default:|'' for|'' means|'' keeps) (.*)$")
_SAID = {"": "", "None": "", "True": "yes", "False": "no"}
_TYPES: dict[str, Callable[[str], Any]] = {"int": int, "float": float, "str": str}
_METAVARS = {"int": "INTEGER", "float": "NUMBER"}


def in_order(text: str) -> str:
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
    """Help in the order of `in_order`; a value that is called after its unit is a NUMBER."""

    def _metavar_formatter(self, action: argparse.Action, default_metavar: str) -> Any:
        unit = _UNIT.search(action.help or "")
        if unit and action.metavar == unit[1].upper():
            return lambda size: ("NUMBER",) * size
        return super()._metavar_formatter(action, default_metavar)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        return in_order(action.help) if action.help else action.help


class OneLineParser(argparse.ArgumentParser):
    """Wrong words are an OptionError, which the command line prints in one line; help is `HelpWords`."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**{"formatter_class": HelpWords, **keywords})

    def error(self, message: str) -> NoReturn:
        """Raise it."""
        raise OptionError(f"{message}; '{self.prog} --help' tells all options")


def add_operation(parser: argparse.ArgumentParser, operation: Operation) -> None:
    """Add every operand and option; what is not given is left out of the namespace."""
    for name, field in operation.fields.items():
        if name in operation.own and written(field).only != "python":
            _add(parser, field)
    for kind in operation.kinds:
        group = parser.add_argument_group(_title(kind))
        for field in declared(kind):
            if operation.fields[field.name] is field:
                _add(group, field)
    if operation.has_json:
        action = parser.add_argument(
            "--json",
            metavar="PATH",
            default=argparse.SUPPRESS,
            help="write the result as JSON; '-' for standard output alone",
        )
        action.on_command_line = OnCommandLine(writes=JSON)  # type: ignore[attr-defined]


def _title(kind: type) -> str:
    return getattr(kind, "title", kind.__name__.removesuffix("Options").lower() + " options")


def _add(parser: Any, field: dataclasses.Field[Any]) -> None:
    meta, how, types = field.metadata, written(field), type_words(field) - {"None"}
    name = next((word for word in ("bool", "int", "float") if word in types), "str")
    required = field.default is dataclasses.MISSING or how.needed
    unit = f" [{meta['unit']}]" if meta["unit"] else ""
    switch = name == "bool" and "written" in meta and field.default is False
    said = not (required or switch or field.default == ())
    default = f" (default: {field.default})" if said else ""
    keywords: dict[str, Any] = {"help": f"{meta['help']}{unit}{default}".replace("%", "%%")}
    if not (required and how.positional):
        keywords["default"] = argparse.SUPPRESS
    if name == "bool":
        keywords["action"] = "store_true" if switch else argparse.BooleanOptionalAction
    else:
        keywords["type"] = _parser(field, how, name)
        if meta["choices"]:
            keywords["choices"] = meta["choices"]
        else:
            keywords["metavar"] = how.metavar or _METAVARS.get(name, "TEXT")
    if how.count == "repeat":
        keywords["action"] = "append"
    elif how.count:
        keywords["nargs"] = how.count
    if how.positional:
        if meta["choices"] and how.metavar:
            keywords["metavar"] = how.metavar
        action = parser.add_argument(field.name, **keywords)
    else:
        flags = [how.short] * bool(how.short) + [flag_of(field)]
        action = parser.add_argument(*flags, dest=field.name, required=required, **keywords)
    action.on_command_line = how


def _parser(field: dataclasses.Field[Any], how: OnCommandLine, name: str) -> Callable[[str], Any]:
    """argparse type: the value of a text, in the option's range."""
    if how.parse is not None:
        return how.parse
    base = _TYPES[name]
    if base is str:
        return str

    def number(text: str) -> Any:
        value = base(text)
        try:
            if "written" in field.metadata and not math.isfinite(value):
                raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
            check_range(field, value, f"'{text}'")
        except OptionError as error:
            raise argparse.ArgumentTypeError(str(error)) from None
        return value

    number.__name__ = base.__name__
    return number


def finite(text: str) -> float:
    """argparse type: a finite float, and one whose square is finite too."""
    value = float(text)
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a finite number")
    if abs(value) > GREATEST:
        raise argparse.ArgumentTypeError(f"'{text}' is beyond any quantity here (in SI units, {GREATEST:g})")
    return value


def natural(text: str) -> int:
    """argparse type: a whole number, 0 or greater."""
    value = int(text)
    if not 0 <= value < 1 << 63:
        raise argparse.ArgumentTypeError(f"'{text}' must be a whole number, 0 or greater")
    return value


def vector(text: str) -> Any:
    """argparse type: three finite numbers, 'X,Y,Z'."""
    import numpy as np

    parts = text.split(",")
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"'{text}' must be three numbers X,Y,Z")
    return np.array([finite(p) for p in parts])
