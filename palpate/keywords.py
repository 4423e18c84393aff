"""The options of the door's functions: every field of the rooms' options dataclasses, by its own name.

A function of the door takes them as keywords, a command as flags; both read them here, so that an option is
declared once, in its room.
"""

from __future__ import annotations

import difflib
import importlib
import typing
from collections.abc import Mapping
from dataclasses import Field, dataclass, fields
from numbers import Integral, Real
from typing import Any

from mechanics.errors import OptionError
from mechanics.options import check_range, span_of

_RENDER = ("render.options:RenderOptions",)
_KINDS: dict[str, tuple[str, ...]] = {
    "reconstruct": (
        "reconstruct.pipeline:ReconstructOptions",
        "reconstruct.geometry.stated:GeometryOptions",
        "reconstruct.steps.s1_filter.low_pass:FilterOptions",
        "reconstruct.steps.s2_base.outline:BoundaryOptions",
        "reconstruct.steps.s3_contacts.contacts:ContactOptions",
        "reconstruct.steps.s4_surface.surface:SurfaceOptions",
        "reconstruct.steps.s5_mesh.meshing:MeshingOptions",
        "reconstruct.steps.s7_modulus.modulus:ModulusOptions",
        "reconstruct.steps.s7_modulus.modulus_field:FieldOptions",
        "reconstruct.steps.s7_modulus.modulus_paper:PaperOptions",
    ),
    "renderer": _RENDER,
    "replay": (*_RENDER, "render.support:SupportOptions"),
    "press": (*_RENDER, "render.support:SupportOptions"),
    "compare": ("diagnose.compare.comparison:CompareOptions",),
    "diagnose": (
        "diagnose.options:DiagnoseOptions",
        "diagnose.options:AttributionOptions",
        "diagnose.options:NuisanceOptions",
    ),
    "changes": ("reconstruct.geometry.stated:GeometryOptions",),
    "calibrate": ("reconstruct.geometry.stated:GeometryOptions",),
    "simulate": ("scenes.laboratory.session:SimulateOptions", "scenes.laboratory.hand:HandOptions"),
}
FUNCTIONS = tuple(_KINDS)


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

    def __str__(self) -> str:
        unit = f" [{self.unit}]" if self.unit else ""
        allowed = f"; one of {', '.join(self.choices)}" if self.choices else ""
        return f"{self.name} = {self.default!r}{unit}: {self.help}{allowed}"


class Options(tuple[Option, ...]):
    """The options of one function; `print` lists them, a line each."""

    def __str__(self) -> str:
        return "\n".join(map(str, self))

    __repr__ = __str__


def options(function: str) -> Options:
    """The keywords that a function of the door takes beside its own arguments: `print(pp.options("press"))`.

    function: reconstruct, renderer, replay, press, compare, changes, diagnose, calibrate or simulate. Each
    option has a name, default, unit and words. Raises OptionError for another name.
    """
    return Options(
        Option(f.name, f.default, f.metadata["unit"], f.metadata["help"], f.metadata["choices"], *span_of(f))
        for kind in kinds(function)
        for f in _declared(kind)
    )


def kinds(function: str) -> list[type]:
    """The options dataclasses of a function of the door."""
    if function not in _KINDS:
        raise OptionError(f"'{function}' has no options; allowed are {', '.join(_KINDS)}")
    paths = (path.split(":") for path in _KINDS[function])
    return [getattr(importlib.import_module(module), name) for module, name in paths]


def taken(function: str, given: Mapping[str, Any]) -> dict[type, dict[str, Any]]:
    """What was given, sorted by options dataclass.

    Raises OptionError for a name that no option has, and for a value of the wrong kind or not allowed.
    """
    sorted_out: dict[type, dict[str, Any]] = {kind: {} for kind in kinds(function)}
    declared = {f.name: (kind, f) for kind in sorted_out for f in _declared(kind)}
    for name, value in given.items():
        if name not in declared:
            near = difflib.get_close_matches(name, declared, 3)
            meant = f"did you mean {', '.join(near)}? " if near else ""
            raise OptionError(
                f"pp.{function} has no option '{name}': {meant}allowed are {', '.join(sorted(declared))}"
            )
        kind, field = declared[name]
        _check(name, value, field, typing.get_type_hints(kind)[name])
        sorted_out[kind][name] = value
    return sorted_out


def _declared(kind: type) -> list[Field]:
    return [f for f in fields(kind) if "help" in f.metadata]


def _check(name: str, value: Any, field: Field, hint: Any) -> None:
    allowed = typing.get_args(hint) or (hint,)
    if value is None and type(None) in allowed:
        return
    choices = field.metadata["choices"]
    if choices and value not in choices:
        raise OptionError(f"{name} is {value!r}; allowed are {', '.join(choices)}")
    for kind, fits, words in (
        (bool, isinstance(value, bool), "True or False"),
        (int, isinstance(value, Integral) and not isinstance(value, bool), "a whole number"),
        (float, isinstance(value, Real) and not isinstance(value, bool), "a number"),
        (str, isinstance(value, str), "a word"),
    ):
        if kind in allowed and not fits:
            unit = f" in {field.metadata['unit']}" if field.metadata["unit"] else ""
            raise OptionError(f"{name} is {value!r}; it must be {words}{unit}")
    check_range(field, value)
