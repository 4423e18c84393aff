"""Validates the JSON of every command that a test runs in its own process."""

from __future__ import annotations

from functools import cache
from typing import Any

import palpate.output
from palpate.mechanics.result import plain
from palpate.schemas import schema


def closed(form: Any) -> Any:
    """The schema with no key beside those that it names: a new one gets its line in `palpate.schemas`."""
    if isinstance(form, list):
        return [closed(each) for each in form]
    if not isinstance(form, dict):
        return form
    inner = {key: closed(value) for key, value in form.items()}
    if isinstance(form.get("properties"), dict) and form.get("type") == "object":
        inner["properties"] = {key: closed(value) for key, value in form["properties"].items()}
        inner.setdefault("additionalProperties", False)
    return inner


@cache
def validator(name: str, strict: bool = True) -> Any:
    """Of one schema; a wrong schema raises."""
    from jsonschema import Draft202012Validator

    found = schema(name)
    Draft202012Validator.check_schema(found)
    return Draft202012Validator(closed(found) if strict else found)


def faults(name: str, value: Any) -> list[str]:
    """Where a value leaves its schema, the deepest of each choice."""
    from jsonschema.exceptions import best_match

    found = [best_match([error]) for error in validator(name).iter_errors(value)]
    return [f"{name} {error.json_path}: {error.message[:300]}" for error in found if error]


def check_every_json() -> None:
    """From now on `emit_json` raises AssertionError for what leaves its schema."""
    write = palpate.output.emit_json

    def checked(value: Any, destination: str | None) -> None:
        write(value, destination)
        if destination is not None and isinstance(value, dict) and "schema" in value:
            name = str(value["schema"]).split(":")[2]
            assert not (wrong := faults(name, plain(value))), wrong

    palpate.output.emit_json = checked
