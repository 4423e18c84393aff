"""An operation, declared once: a function, the frozen dataclass of its operands, the options that it takes.

    @dataclass(frozen=True)
    class StretchOperands:
        model: ModelLike = operand(REQUIRED, "what is stretched", metavar="MODEL", positional=True)
        _: KW_ONLY
        by_m: float = operand(0.001, "how far", unit="m")

    @operation(StretchOperands, RenderOptions)
    def stretch(asked: StretchOperands, call: Call) -> Curve: ...

From the fields come the Python call's signature and docstring, `pp.options("stretch")`, and the flags and
help of `palpate stretch` (`palpate.operations._to_argparse`).
"""

from __future__ import annotations

import dataclasses
import functools
import importlib
import inspect
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

from palpate.mechanics.disk.writing import FolderKind, Kind, check_target
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import near, unknown
from palpate.mechanics.options import option, span_of
from palpate.mechanics.progress import Progress, silent
from palpate.operations._fields import Option, Options, check
from palpate.operations._list import calls
from palpate.output import Output, progress_bar

T = TypeVar("T")
R = TypeVar("R")
REQUIRED: Any = ...
"""In the place of a default, where an operand has none."""
STREAMS = ("-", "none")
"""In the place of a path: standard output, and no file at all."""
GREATEST = 1e15
"""No quantity here is greater, in SI units; its square is finite too."""


@dataclass(frozen=True)
class OnCommandLine:
    """How an operand is written on the command line.

    metavar: its value in help; short: another spelling, as -o; positional: without a flag; count: argparse's
    nargs ("?", "+", "*", "..."), or "repeat" for a flag that may be given several times; parse: from text to
    the value; reads: names a file or folder that is read; writes: one that is written, its
    `mechanics.disk.writing.Kind`, or where that is as "module:NAME"; needed: on the command line, though it
    has a default; only: "command" or "python" where it is one's alone; rare: `--help` leaves it to
    `--help-all`.
    """

    metavar: str = ""
    short: str = ""
    positional: bool = False
    count: str = ""
    parse: Callable[[str], Any] | None = None
    reads: bool = False
    writes: Kind | FolderKind | str | None = None
    needed: bool = False
    only: str = ""
    rare: bool = False

    def kind(self) -> Kind | FolderKind | None:
        """What is written; None for nothing."""
        if not isinstance(self.writes, str):
            return self.writes
        module, name = self.writes.split(":")
        return getattr(importlib.import_module(module), name)


def operand(
    default: Any,
    help: str,
    *,
    unit: str = "",
    flag: str | None = None,
    choices: Sequence[str] | None = None,
    low: float = -GREATEST,
    high: float = GREATEST,
    **written: Any,
) -> Any:
    """A field of an operands dataclass: `mechanics.options.option`, and its `OnCommandLine` by keyword."""
    made = option(default, help, unit=unit, flag=flag, choices=choices, low=low, high=high)
    metadata = {**made.metadata, "written": OnCommandLine(**written)}
    if default is REQUIRED:
        return dataclasses.field(metadata=metadata)
    return dataclasses.field(default=default, metadata=metadata)


def written(field: dataclasses.Field[Any]) -> OnCommandLine:
    """How a field is written; that of an options dataclass is a flag with one value."""
    return field.metadata.get("written") or OnCommandLine()


def declared(kind: Any) -> list[dataclasses.Field[Any]]:
    """The fields of a dataclass that are options or operands."""
    return [f for f in dataclasses.fields(kind) if "help" in f.metadata]


@dataclass(frozen=True)
class Call:
    """One call of an operation. given: what was given, by name; wanted: whether or where progress goes;
    out: what a command says on the way, silent in a Python call."""

    given: Mapping[str, Any]
    wanted: bool | Progress = True
    out: Output = dataclasses.field(default_factory=lambda: Output("-"))

    def of(self, kind: type[T], **instead: Any) -> T:
        """An options dataclass with what was given of it. instead: fields that are set here."""
        return kind(**{**self.values(kind), **instead})

    def values(self, kind: type) -> dict[str, Any]:
        """What was given of an options dataclass, by field."""
        return {f.name: self.given[f.name] for f in declared(kind) if f.name in self.given}

    @contextmanager
    def progress(self, label: str) -> Iterator[Progress]:
        """Where progress goes: to a callable, to a bar on a terminal, or nowhere."""
        if callable(self.wanted):
            yield self.wanted
        elif self.wanted:
            with progress_bar(label) as bar:
                yield bar
        else:
            yield silent


class Operation:
    """What was declared; every function made by `operation` has it as its attribute `operation`.

    often: the options of `kinds` that `--help` shows; the others wait for `--help-all`. before: what the
    command alone looks at before the work; answer: what it does with the result (`palpate.operations._run`);
    None prints its lines, and writes JSON and files.
    """

    def __init__(
        self,
        function: Callable[[Any, Call], Any],
        operands: Any,
        kinds: Sequence[type],
        *,
        often: str | None,
        before: Callable[[Any], None] | None,
        answer: Callable[..., int] | None,
        has_progress: bool,
        has_json: bool,
    ) -> None:
        self.name, self.function, self.operands = function.__name__, function, operands
        self.own = {each.name for each in dataclasses.fields(operands)}
        self.kinds, self.before, self.answer = tuple(kinds), before, answer
        self.has_progress, self.has_json = has_progress, has_json
        self.fields: dict[str, dataclasses.Field[Any]] = {}
        for kind in (operands, *kinds):
            for each in declared(kind):
                self.fields.setdefault(each.name, each)
        self.often = set(self.fields) - self.own if often is None else set(often.split())

    def is_often(self, field: dataclasses.Field[Any]) -> bool:
        """Whether `--help` shows it."""
        return field.name in self.often or (field.name in self.own and not written(field).rare)

    def signature(self, result: Any) -> inspect.Signature:
        """That of the Python call: operands in their order, then every option by name."""
        parameters = []
        for field in self.fields.values():
            if written(field).only == "command":
                continue
            own = field.name in self.own
            kind: Any = inspect.Parameter.KEYWORD_ONLY
            if own and not field.kw_only:
                many = str(field.type).startswith("tuple")
                kind = inspect.Parameter.VAR_POSITIONAL if many else inspect.Parameter.POSITIONAL_OR_KEYWORD
            default = inspect.Parameter.empty if field.default is dataclasses.MISSING else field.default
            if kind is inspect.Parameter.VAR_POSITIONAL:
                default = inspect.Parameter.empty
            parameters.append(inspect.Parameter(field.name, kind, default=default, annotation=field.type))
        if self.has_progress:
            parameters.append(
                inspect.Parameter(
                    "progress", inspect.Parameter.KEYWORD_ONLY, default=True, annotation="bool | Progress"
                )
            )
        return inspect.Signature(parameters, return_annotation=result)

    def documentation(self) -> str:
        """The function's own words, then a line an operand or option: unit, meaning, what is allowed."""
        lines = [inspect.getdoc(self.function) or "", ""]
        lines += [each.words for each in self.listed()]
        if self.has_progress:
            lines.append("progress: False for none; or a function of (stage, share done) that is told of it")
        return "\n".join(lines)

    def listed(self) -> list[Option]:
        """What a Python call takes: operands in their order, then every option."""
        return [
            Option(f.name, f.default, meta["unit"], meta["help"], meta["choices"], *span_of(f))
            for f in self.fields.values()
            if written(f).only != "command" and (meta := f.metadata)
        ]

    def run(
        self, given: Mapping[str, Any], wanted: bool | Progress = True, out: Output | None = None
    ) -> tuple[Any, Any]:
        """(operands, result) of what was given by name. out: of a command, None for a Python call.

        Raises OptionError for a value of the wrong kind or not allowed, FileError for what cannot be written.
        """
        for name, value in given.items():
            check(name, value, self.fields[name])
            kind = written(self.fields[name]).kind()
            if kind is not None and value is not None and str(value) not in STREAMS:
                check_target(value, kind)
        asked = self.operands(**{name: value for name, value in given.items() if name in self.own})
        importlib.import_module("palpate.show")  # lets every result say and draw itself
        if out is None:
            return asked, self.function(asked, Call(given, wanted))
        if self.before is not None:
            self.before(asked)
        return asked, self.function(asked, Call(given, wanted, out))


def operation(
    operands: type,
    *kinds: type,
    often: str | None = None,
    before: Callable[[Any], None] | None = None,
    answer: Callable[..., int] | None = None,
    progress: bool = True,
    json: bool = True,
) -> Callable[[Callable[[Any, Call], R]], Callable[..., R]]:
    """Make a function of (operands, Call) an operation. kinds: the options dataclasses that it takes too;
    often: names of those of their options that most people use, with blanks; None: all."""

    def made(function: Callable[[Any, Call], R]) -> Callable[..., R]:
        this = Operation(
            function,
            operands,
            kinds,
            often=often,
            before=before,
            answer=answer,
            has_progress=progress,
            has_json=json,
        )
        signature = this.signature(function.__annotations__.get("return"))

        @functools.wraps(function)
        def called(*positional: Any, **named: Any) -> R:
            known(this.name, named, signature.parameters)
            given = signature.bind(*positional, **named).arguments
            return this.run(given, given.pop("progress", True))[1]

        public: Any = called
        public.__signature__, public.__doc__, public.operation = signature, this.documentation(), this
        public.__annotations__ = {p.name: p.annotation for p in signature.parameters.values()}
        return public

    return made


def operation_of(name: str) -> Operation:
    """The operation behind a Python name; raises OptionError for another."""
    homes = calls()
    if name not in homes:
        raise OptionError(unknown(name, "operation", homes))
    return getattr(importlib.import_module(homes[name]), name).operation


def known(name: str, given: Mapping[str, Any], allowed: Mapping[str, Any]) -> None:
    """Raise OptionError for a name that no operand or option has."""
    for each in given:
        if each not in allowed:
            like = near(each, allowed, 3)
            meant = f"did you mean {', '.join(like)}? " if like else ""
            raise OptionError(
                f"pp.{name} has no option '{each}': {meant}allowed are {', '.join(sorted(allowed))}"
            )


def check_options(name: str, given: Mapping[str, Any]) -> None:
    """Raise OptionError for what an operation would refuse, before any work."""
    this = operation_of(name)
    known(name, given, this.fields)
    for each, value in given.items():
        check(each, value, this.fields[each])
    for kind in this.kinds:
        Call(given).of(kind)  # which refuses names that it does not know


def options(function: str) -> Options:
    """The keywords that have a default, of an operation: `print(pp.options("press"))`.

    function: the name of any function of `palpate` that is an operation. Each option has a name, default,
    unit and words. Raises OptionError for another name.
    """
    return Options(o for o in operation_of(function).listed() if o.default is not dataclasses.MISSING)
