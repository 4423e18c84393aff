"""What schemas are made of: short names for JSON Schema (draft 2020-12), and the schema of a TOML's table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from palpate.mechanics.disk.schema import FileKey, Listed, Named, Schema

Form = dict[str, Any]

ANYTHING: Form = {}
NUMBER: Form = {"type": "number"}
COUNT: Form = {"type": "integer", "minimum": 0}
SHARE: Form = {"type": "number", "minimum": 0, "maximum": 1}
TEXT: Form = {"type": "string"}
FLAG: Form = {"type": "boolean"}
_KINDS = {float: "number", int: "integer", bool: "boolean", str: "string"}


def or_null(form: Form) -> Form:
    """That, or null where it is not known."""
    return {"anyOf": [form, {"type": "null"}]}


def many(form: Form, count: int | None = None) -> Form:
    """A list of these, as long as one likes or `count`."""
    length = {} if count is None else {"minItems": count, "maxItems": count}
    return {"type": "array", "items": form, **length}


def named(form: Form) -> Form:
    """These by names that are not known before."""
    return {"type": "object", "additionalProperties": form}


def one_of(words: Sequence[str]) -> Form:
    """One of these words."""
    return {"enum": list(words)}


def either(*forms: Form) -> Form:
    """Any of these."""
    return {"anyOf": list(forms)}


class Sometimes(Form):
    """The form of a key that is not always there."""


def table(**keys: Form) -> Form:
    """An object with these keys, all of them there but for those that are `Sometimes`. Further keys may
    join."""
    needed = [name for name, form in keys.items() if not isinstance(form, Sometimes)]
    return {"type": "object", "properties": keys, "required": needed}


MAYBE = or_null(NUMBER)
VECTOR = many(NUMBER, 3)
INTERVAL = many(NUMBER, 2)
MAYBE_INTERVAL = or_null(INTERVAL)


def of_toml(keys: Schema) -> Form:
    """The schema of a table of a TOML, as `mechanics.disk.schema` checks it."""
    needed = [name for name, key in keys.items() if isinstance(key, FileKey) and key.required]
    properties = {name: _form(key) for name, key in keys.items()}
    return {"type": "object", "properties": properties, **({"required": needed} if needed else {})}


def _form(key: FileKey | Named | Listed | Schema | None) -> Form:
    if key is None:
        return ANYTHING
    if isinstance(key, Named):
        return named(of_toml(key.form))
    if isinstance(key, Listed):
        return many(of_toml(key.form))
    if not isinstance(key, FileKey):
        return of_toml(key)
    one: Form = {"type": _KINDS[key.kind]}
    if key.choices:
        one = one_of(key.choices)
    elif not key.unknown:  # nan and inf, which TOML has, are in no range
        one |= {"minimum": key.low} if math.isfinite(key.low) else {}
        one |= {"maximum": key.high} if math.isfinite(key.high) else {}
    form = one if key.size is None else many(one, key.size or None)
    words = f"{key.unit}; nan or inf where nobody knows" if key.unknown else key.unit
    return {**form, "description": words} if words else form
