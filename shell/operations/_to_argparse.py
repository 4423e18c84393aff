"""The flags and help of a command, from what its operation declares."""

from __future__ import annotations

import argparse
import dataclasses
import math
import re
import sys
from collections.abc import Callable
from typing import Any, NoReturn

from palpate.logs import LEVELS
from palpate.mechanics.disk.writing import JSON
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import near, unknown
from palpate.mechanics.options import check_range, flag_of
from palpate.operations._declare import GREATEST, OnCommandLine, Operation, declared, type_words, written

_DEFAULT = re.compile(r" *\(default: ([^()]*(?:\([^()]*\)[^()]*)*)\)")
_UNIT = re.compile(r" *\[([^\[\]]{1,9})\](?=$| \()")
_NONE = re.compile(r"[;,] (?:None:|default:|'' for|'' means|'' keeps) (.*)$")
_SAID = {"": "", "None": "", "True": "yes", "False": "no"}
_NEGATIVE = re.compile(r"-(\.?\d|inf|[xyz](,|$))", re.IGNORECASE)
"""A number, numbers or an axis, and no option."""
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
    """Wrong words are an OptionError, which the command line prints in one line, with what was probably
    meant; help is `HelpWords`, and shows what most people use; `--help-all` shows every option."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**{
            "formatter_class": HelpWords, "add_help": False, "allow_abbrev": False, **keywords,
        })  # fmt: skip
        self.add_argument("-h", "--help", action="help", help="show this help and exit")
        self.add_argument("--help-all", action=_AllHelp, help="show every option and exit")

    def error(self, message: str) -> NoReturn:
        """Raise it."""
        raise OptionError(f"{message}; '{self.prog} --help' lists the options")

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse, but a flag that is not there is answered with the one that was probably meant."""
        words = sys.argv[1:] if args is None else list(args)
        flags = [f for action in self._actions for f in action.option_strings if f.startswith("--")]
        if not any(action.nargs == argparse.REMAINDER for action in self._actions):
            for word in words[: words.index("--") if "--" in words else None]:
                flag = word.partition("=")[0]
                if word.startswith("--") and flag not in flags:
                    like = [each for each in flags if each.startswith(flag)] or near(flag, flags)
                    self.error(f"'{flag}' is not an option" + (f"; did you mean {like[0]}?" if like else ""))
            words = self._with_their_values(words)
        return super().parse_args(words, namespace)

    def _with_their_values(self, words: list[str]) -> list[str]:
        """Options joined to values that begin with a minus, which argparse takes for options of their own."""
        takers = [flag for action in self._actions if action.nargs is None for flag in action.option_strings]
        joined: list[str] = []
        for word in words:
            last = joined[-1] if joined else ""
            if "--" not in joined and last in takers and _NEGATIVE.match(word):
                joined[-1] = f"{last}={word}"
            else:
                joined.append(word)
        return joined

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            choices = [str(each) for each in action.choices]
            raise argparse.ArgumentError(action, unknown(str(value), "choice", choices))

    def advanced(self) -> list[argparse.Action]:
        """What `--help` does not show."""
        return [action for action in self._actions if getattr(action, "advanced", False)]

    def format_help(self) -> str:
        """What most people use, and how many more options there are."""
        advanced = {action: action.help for action in self.advanced()}
        if not advanced:
            return super().format_help()
        for action in advanced:
            action.help = argparse.SUPPRESS
        try:
            text = super().format_help()
        finally:
            for action, words in advanced.items():
                action.help = words
        more = "more option" + "s" * (len(advanced) > 1)
        return f"{text}\n{len(advanced)} {more}: {self.prog} --help-all\n"

    def format_all_help(self) -> str:
        """Every option."""
        return super().format_help()


class _AllHelp(argparse.Action):
    """--help-all"""

    def __init__(self, option_strings: Any, dest: str, **keywords: Any) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, default=argparse.SUPPRESS, **keywords)

    def __call__(self, parser: Any, namespace: Any, values: Any, option_string: Any = None) -> None:
        print(parser.format_all_help(), end="")
        parser.exit()


def add_operation(parser: argparse.ArgumentParser, operation: Operation) -> None:
    """Add every operand and option; what is not given is left out of the namespace."""
    for name, field in operation.fields.items():
        if name in operation.own and written(field).only != "python":
            _add(parser, field, operation.is_common(field))
    for kind in operation.kinds:
        group = parser.add_argument_group(_title(kind))
        for field in declared(kind):
            if operation.fields[field.name] is field:
                _add(group, field, operation.is_common(field))
    if operation.has_json:
        action = parser.add_argument(
            "--json",
            metavar="PATH",
            default=argparse.SUPPRESS,
            help="write the result as JSON; '-' writes only JSON to standard output",
        )
        action.on_command_line = OnCommandLine(writes=JSON)  # type: ignore[attr-defined]
    level: Any = parser.add_argument(
        "--log-level",
        choices=LEVELS,
        default=argparse.SUPPRESS,
        help="what is logged to standard error, from this level on (default: warning)",
    )
    level.advanced = True


def _title(kind: type) -> str:
    return getattr(kind, "title", kind.__name__.removesuffix("Options").lower() + " options")


def _add(parser: Any, field: dataclasses.Field[Any], common: bool) -> None:
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
    action.on_command_line, action.advanced = how, not common


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
