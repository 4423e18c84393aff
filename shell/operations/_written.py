"""A command as one would type it, of what was given by name; `palpate open` with what is added to go on."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from palpate.mechanics.options import flag_of
from palpate.mechanics.recording.recording import Recording, stated_object
from palpate.operations._declare import written
from palpate.operations._run import command_operation
from palpate.show.page import file_words

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model

_GEOMETRIES = {"shape", "slab_m", "half_space"}


def open_words(given: Mapping[str, Any], more: Mapping[str, Any]) -> str:
    """The command `palpate open`. given: operands by name, and under "names" the column of each role; more:
    what is added, a column by its role ('-fz': the negative of what is fz now). One geometry takes the place
    of another, and of what was forced for want of it."""
    dropped = {*_GEOMETRIES, "force"} if _GEOMETRIES & set(more) else set()
    told = {name: value for name, value in given.items() if name not in {*dropped, "names"}}
    for name, value in more.items():
        if name == "columns":
            value = {role: _named(text, given.get("names") or {}) for role, text in value.items()}
        told[name] = {**(told.get(name) or {}), **value} if isinstance(value, Mapping) else value
    return typed("open", told)


def import_words(given: Mapping[str, Any], output: str) -> str:
    """The command `palpate import` that leaves behind the recording which `palpate open` made of a table."""
    fields = command_operation("import")[0].fields
    return typed("import", {k: v for k, v in {**given, "output": output}.items() if k in fields})


def reconstruct_words(recording: str, model: Model) -> str:
    """The command `palpate reconstruct` of another recording of the object, by the geometry that a model was
    made by."""
    return typed("reconstruct", {"recording": recording, **_geometry_of(model)}) + " -o MODEL"


def with_geometry_of(model: Model, recording: Recording) -> Recording:
    """A recording whose [object] states the geometry that a model was made by, where it states none."""
    from palpate.reconstruction.geometry.stated import GeometryOptions, as_stated

    stated, thing = as_stated(GeometryOptions(**_geometry_of(model))), recording.description.get("object", {})
    if "shape" in stated:
        stated["shape"] = os.path.abspath(stated["shape"])
    object_ = {**stated, **thing} if not stated_object(recording) else thing
    return replace(recording, description={**recording.description, "object": object_})


def _geometry_of(model: Model) -> dict[str, Any]:
    """Options of the geometry that a model was made by, as far as they are not the usual ones."""
    from palpate.reconstruction.geometry.stated import GeometryOptions

    made = (model.provenance.get("options") or {}).get("geometry") or {}
    return {name: value for name, value in made.items() if value != getattr(GeometryOptions(), name, value)}


def typed(name: str, given: Mapping[str, Any]) -> str:
    """The command `palpate NAME` with operands by name."""
    fields, operands, flags = command_operation(name)[0].fields, [], []
    for each, value in given.items():
        how = written(fields[each])
        if how.positional:
            several = value if isinstance(value, tuple) else (value,)
            operands += [file_words(getattr(v, "path", v), "REC") for v in several]
        else:
            flags += _flag(flag_of(fields[each]), value, how.count == "repeat")
    return " ".join(["palpate", name, *operands, *flags])


def _named(text: str, names: Mapping[str, str]) -> str:
    """A column as the file calls it; a sign that it has there is turned."""
    role = text.removeprefix("-")
    name = names.get(role) or role
    turned = text.startswith("-") != name.startswith("-")
    return f"{'-' * turned}{name.removeprefix('-')}"


def _flag(flag: str, value: Any, repeated: bool) -> list[str]:
    if value is None or value is False or value == "" or value == {}:
        return []
    if value is True:
        return [flag]
    if isinstance(value, Mapping):
        pairs = [f"{key}={each}" for key, each in value.items()]
        return [f"{flag} {shlex.quote(each)}" for each in (pairs if repeated else [",".join(pairs)])]
    if isinstance(value, list | tuple):
        each = [f"{one:g}" if isinstance(one, float) else str(one) for one in value]
        return [f"{flag} {shlex.quote(one)}" for one in (each if repeated else [",".join(each)])]
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return [f"{flag}{'=' if text.startswith('-') else ' '}{shlex.quote(text)}"]
