"""An operation is its signature: flags, help, completion, the Python call and its checks are read from it.

    @operation(common="friction")
    def stretch(
        model: Annotated[ModelLike, argument("what is stretched", metavar="MODEL", reads=True)],
        *,
        by_m: Annotated[float, option("how far", unit="m")] = 0.001,
        render: RenderOptions,
        call: Call,
    ) -> Curve: ...

An options dataclass becomes a flag a field, and arrives made. From this come `pp.stretch(model, by_m=0.002)`,
`pp.options("stretch")` and `palpate stretch MODEL --by 0.002` (`palpate.operations._to_argparse`). A module
has `from __future__ import annotations`: types stay words, of which only what describes an operand is
evaluated, so that a type may be imported under TYPE_CHECKING.

One field of an operation: of which kinds it is, whether a value may stand there, and how it is listed.
"""

from __future__ import annotations

import ast
import dataclasses
import functools
import importlib
import inspect
import typing
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Any, Generic, TypeVar

from palpate.mechanics.disk.writing import FolderKind, Kind, check_target
from palpate.mechanics.errors import OptionError
from palpate.mechanics.names import near, unknown
from palpate.mechanics.options import check_range, span_of
from palpate.operations._call import Call
from palpate.operations._list import calls

_KINDS: dict[str, tuple[Callable[[Any], bool], str]] = {
    "bool": (lambda v: isinstance(v, bool), "True or False"),
    "int": (lambda v: isinstance(v, Integral) and not isinstance(v, bool), "a whole number"),
    "float": (lambda v: isinstance(v, Real) and not isinstance(v, bool), "a number"),
    "str": (lambda v: isinstance(v, str), "a word"),
}


def type_words(field: dataclasses.Field[Any]) -> set[str]:
    """The names of a field's types: {"float", "None"}."""
    text = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", str(field.type))
    return {part.strip() for part in text.split("|")}


def check(name: str, value: Any, field: dataclasses.Field[Any]) -> None:
    """Raise OptionError for a value of the wrong kind, not among the choices, or out of range."""
    types = type_words(field)
    if value is None and "None" in types:
        return
    choices = field.metadata["choices"]
    if choices and value not in choices:
        like = near(str(value), choices)
        meant = f"did you mean {like[0]}? " if like else ""
        raise OptionError(f"{name} is {value!r}; {meant}allowed are {', '.join(choices)}")
    plain = types - {"None"}
    if len(plain) == 1 and (word := plain.pop()) in _KINDS and not _KINDS[word][0](value):
        unit = f" in {field.metadata['unit']}" if field.metadata["unit"] else ""
        raise OptionError(f"{name} is {value!r}; it must be {_KINDS[word][1]}{unit}")
    check_range(field, value)


@dataclass(frozen=True)
class Option:
    """One option: its name as a keyword, default, unit ('' for a pure number or a word), words, the only
    values allowed where they are few, and the least and greatest number."""

    name: str
    default: Any
    unit: str
    help: str
    choices: tuple[str, ...] | None
    low: float
    high: float

    @property
    def words(self) -> str:
        """Name, unit, meaning, and what is allowed."""
        return f"{self.name}{self._said}"

    @property
    def _said(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        allowed = f"; one of {', '.join(self.choices)}" if self.choices else ""
        return f"{unit}: {self.help}{allowed}"

    def __str__(self) -> str:
        return f"{self.name} = {self.default!r}{self._said}"


class Options(tuple[Option, ...]):
    """The options of one operation; `print` lists them, a line each."""

    def __str__(self) -> str:
        return "\n".join(map(str, self))

    __repr__ = __str__


T = TypeVar("T")
R = TypeVar("R")
Field = dataclasses.Field[Any]
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
    has a default; only: "command" or "python" where it is one's alone; advanced: `--help` leaves it to
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
    advanced: bool = False

    def kind(self) -> Kind | FolderKind | None:
        """What is written; None for nothing."""
        if not isinstance(self.writes, str):
            return self.writes
        module, name = self.writes.split(":")
        return getattr(importlib.import_module(module), name)


def option(
    help: str,
    *,
    unit: str = "",
    flag: str | None = None,
    choices: Sequence[str] | None = None,
    low: float = -GREATEST,
    high: float = GREATEST,
    **written: Any,
) -> Mapping[str, Any]:
    """What describes an operand in `Annotated[TYPE, option(...)]`, as `mechanics.options.option` describes a
    field; its `OnCommandLine` by keyword."""
    return {
        "help": help, "unit": unit, "flag": flag, "choices": tuple(choices) if choices else None,
        "low": low, "high": high, "written": OnCommandLine(**written),
    }  # fmt: skip


def argument(help: str, **more: Any) -> Mapping[str, Any]:
    """As `option`, of what is written without a flag."""
    return option(help, positional=True, **more)


def written(field: Field) -> OnCommandLine:
    """How a field is written; that of an options dataclass is a flag with one value."""
    return field.metadata.get("written") or OnCommandLine()


def declared(kind: Any) -> list[Field]:
    """The fields of an options dataclass that are flags."""
    return [f for f in dataclasses.fields(kind) if "help" in f.metadata]


class Given(dict[str, Any], Generic[T]):
    """As the type of an operand: an options dataclass of which only what was given arrives, by field."""


@dataclass(frozen=True)
class EachOf:
    """As what describes an operand: options dataclasses by name; they arrive made, by the same names."""

    kinds: Mapping[str, type]


def _nested(kind: type) -> dict[str, type]:
    """The options dataclasses inside one, by field; its metadata may say that they are no flags."""
    inside: dict[str, Any] = {
        f.name: f.default_factory for f in dataclasses.fields(kind) if f.metadata.get("flags", True)
    }
    return {name: each for name, each in inside.items() if _is_options(each) and declared(each)}


def _is_options(about: Any) -> bool:
    return isinstance(about, type) and dataclasses.is_dataclass(about)


def _made(kind: type, given: Mapping[str, Any]) -> Any:
    """An options dataclass with what was given of it and of those inside it."""
    inside = {name: _made(each, given) for name, each in _nested(kind).items()}
    said = {f.name: given[f.name] for f in dataclasses.fields(kind) if f.name in given}
    return kind(**{**said, **inside})


@dataclass(frozen=True)
class Group:
    """An operand that is options. names: under which they arrive, one without a name as itself; bare: only
    what was given arrives."""

    names: Mapping[str, type]
    bare: bool = False

    @property
    def kinds(self) -> list[type]:
        """Every options dataclass, those inside of another after it."""
        return [each for kind in self.names.values() for each in (kind, *_nested(kind).values())]

    def arriving(self, given: Mapping[str, Any]) -> Any:
        """What the function gets; raises OptionError for what a dataclass refuses."""
        if self.bare:
            return Given({f.name: given[f.name] for k in self.kinds for f in declared(k) if f.name in given})
        made = {name: _made(kind, given) for name, kind in self.names.items()}
        return made.get("", made)


class Operation:
    """What was declared; every function made by `operation` has it as its attribute `operation`.

    own: the operands that are described one by one, with their parameters; groups: those that are options;
    fields: every operand and option by name; common: the options that `--help` shows; the others wait for
    `--help-all`.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        *,
        common: str | None,
        has_progress: bool,
        has_json: bool,
        like: Callable[..., Any] | None,
    ) -> None:
        self.name, self.function = function.__name__, function
        self.has_progress, self.has_json = has_progress, has_json
        source = like.operation.function if like is not None else function  # type: ignore[attr-defined]
        self.declaration = inspect.signature(source)
        self.own: dict[str, inspect.Parameter] = {}
        self.groups: dict[str, Group] = {}
        self.takes_call = ""
        self.fields: dict[str, Field] = {}
        for name, parameter in self.declaration.parameters.items():
            words, about = _read(parameter.annotation, source.__globals__)
            if about is Call:
                self.takes_call = name if like is None else ""
            elif (group := _group(about)) is not None:
                self.groups[name] = group
            elif isinstance(about, Mapping):
                self.own[name] = parameter
                self.fields[name] = _field(parameter, words, about)
            else:
                raise TypeError(f"{self.name}: '{name}: {words}' is not described, nor options, nor the Call")
        for kind in self.kinds:
            for each in declared(kind):
                self.fields.setdefault(each.name, each)
        self.common = set(self.fields) - set(self.own) if common is None else set(common.split())

    @property
    def kinds(self) -> list[type]:
        """The options dataclasses, in the order of help."""
        return [kind for group in self.groups.values() for kind in group.kinds]

    def is_common(self, field: Field) -> bool:
        """Whether `--help` shows it."""
        return field.name in self.common or (field.name in self.own and not written(field).advanced)

    def signature(self, result: Any) -> inspect.Signature:
        """That of the Python call: operands in their order, then every option by name."""
        parameters = [
            parameter.replace(annotation=self.fields[name].type)
            for name, parameter in self.own.items()
            if written(self.fields[name]).only != "command"
        ]
        more = [(f.name, f.default, f.type) for name, f in self.fields.items() if name not in self.own]
        if self.has_progress:
            more.append(("progress", True, "bool | Progress"))
        named = inspect.Parameter.KEYWORD_ONLY
        parameters += [inspect.Parameter(n, named, default=d, annotation=t) for n, d, t in more]
        return inspect.Signature(parameters, return_annotation=result)

    def documentation(self) -> str:
        """The function's own words, then a line an operand or option: unit, meaning, what is allowed."""
        lines = [inspect.getdoc(self.function) or "", ""]
        lines += [each.words for each in self.listed()]
        if self.has_progress:
            lines.append(
                "progress: False for none; or a function of (stage, share done) that is called with it"
            )
        return "\n".join(lines)

    def listed(self) -> list[Option]:
        """What a Python call takes: operands in their order, then every option."""
        return [
            Option(f.name, f.default, meta["unit"], meta["help"], meta["choices"], *span_of(f))
            for f in self.fields.values()
            if written(f).only != "command" and (meta := f.metadata)
        ]

    def refuse(self, given: Mapping[str, Any]) -> None:
        """Raise OptionError for a value of the wrong kind or not allowed."""
        for name, value in given.items():
            check(name, value, self.fields[name])

    def arriving(self, given: Mapping[str, Any]) -> dict[str, Any]:
        """What the function gets of what was given by name; raises OptionError."""
        groups = {name: group.arriving(given) for name, group in self.groups.items()}
        return {name: given[name] for name in self.own if name in given} | groups

    def run(self, given: Mapping[str, Any], call: Call) -> Any:
        """Do it with what was given by name.

        Raises OptionError for a value of the wrong kind or not allowed, FileError for what cannot be written.
        """
        self.refuse(given)
        for name, value in given.items():
            kind = written(self.fields[name]).kind()
            if kind is not None and value is not None and str(value) not in STREAMS:
                check_target(value, kind)
        call.given = dict(given)
        importlib.import_module("palpate.show")  # lets every result say and draw itself
        arguments = self.arriving(given) | ({self.takes_call: call} if self.takes_call else {})
        bound = inspect.BoundArguments(self.declaration, arguments)
        return self.function(*bound.args, **bound.kwargs)


def _read(annotation: Any, names: dict[str, Any]) -> tuple[str, Any]:
    """(the words of a type, what describes it: of an Annotated type what stands beside it, else the type
    itself; None where its name is not there). annotation: words, of which no more than that is evaluated."""
    tree = ast.parse(annotation, mode="eval").body
    if isinstance(tree, ast.Subscript) and ast.unparse(tree.value) == "Annotated":
        assert isinstance(tree.slice, ast.Tuple)
        kind, about = tree.slice.elts
        return ast.unparse(kind), _evaluated(about, names)
    found = None
    try:
        found = _evaluated(tree, names)
    except NameError:
        pass  # a type that is known to type checkers alone
    if typing.get_origin(found) is typing.Annotated:
        kind, about = typing.get_args(found)
        words = getattr(kind, "__forward_arg__", None) or getattr(kind, "__name__", None) or str(kind)
        return words, about
    return ast.unparse(tree), found


def _evaluated(tree: ast.expr, names: dict[str, Any]) -> Any:
    return eval(compile(ast.Expression(tree), "<signature>", "eval"), names)


def _group(about: Any) -> Group | None:
    """The options that an operand is; None for one value."""
    if isinstance(about, EachOf):
        return Group(about.kinds)
    if typing.get_origin(about) is Given:
        return Group({"": typing.get_args(about)[0]}, bare=True)
    return Group({"": about}) if _is_options(about) else None


def _field(parameter: inspect.Parameter, words: str, about: Mapping[str, Any]) -> Field:
    """An operand as a field, as options have them."""
    many = parameter.kind is parameter.VAR_POSITIONAL
    needed = parameter.default is parameter.empty
    default: Any = () if many else dataclasses.MISSING if needed else parameter.default
    made: Field = dataclasses.field(default=default, metadata=about)
    made.name, made.type = parameter.name, f"tuple[{words}, ...]" if many else words
    return made


def operation(
    *,
    common: str | None = None,
    progress: bool = True,
    json: bool = True,
    like: Callable[..., Any] | None = None,
) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """Make a function an operation. common: the options, with blanks, that most people use, None: all;
    progress: whether it tells of its progress; json: whether its command has --json; like: another operation,
    whose signature it has."""

    def made(function: Callable[..., R]) -> Callable[..., R]:
        this = Operation(function, common=common, has_progress=progress, has_json=json, like=like)
        signature = this.signature(function.__annotations__.get("return"))

        @functools.wraps(function)
        def called(*positional: Any, **named: Any) -> R:
            known(this.name, named, signature.parameters)
            given = signature.bind(*positional, **named).arguments
            return this.run(given, Call(given.pop("progress", True)))

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
    this.refuse(given)
    this.arriving(given)  # whose options refuse names that they do not know


def options(function: str) -> Options:
    """The keywords that have a default, of an operation: `print(pp.options("press"))`.

    function: the name of any function of `palpate` that is an operation. Each option has a name, default,
    unit and words. Raises OptionError for another name.
    """
    return Options(o for o in operation_of(function).listed() if o.default is not dataclasses.MISSING)
