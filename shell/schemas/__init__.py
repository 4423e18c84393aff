"""JSON Schemas (draft 2020-12) of what the program writes and reads: each command's `--json`, each TOML.

    from palpate.schemas import names, schema
    schema("diagnose"), schema("recording.toml")

A `--json` says by its key `schema` which one it follows: the `$id`, whose last part is the version. New keys
may join a version; a key that is renamed, dropped or means something else makes the next.
"""

from __future__ import annotations

from typing import Any

from palpate.schemas.answers import ANSWERS
from palpate.schemas.forms import Form, of_toml

VERSION = 1
"""Of every `--json`."""
TOMLS = ("recording.toml", "model.toml", "tool.toml", "scene.toml", "mapping.toml")


def names() -> tuple[str, ...]:
    """Every schema: commands with --json, then the kinds of TOML."""
    return (*sorted({*ANSWERS, "calibrate"}), *TOMLS)


def identity(name: str) -> str:
    """`$id` of a schema, and the key `schema` of a `--json`."""
    return f"urn:palpate:{name}:{VERSION}"


def labelled(name: str, figures: dict[str, Any]) -> dict[str, Any]:
    """A command's `--json`, with its schema first where it has one."""
    return {"schema": identity(name), **figures} if name in names() else figures


def schema(name: str) -> Form:
    """One of `names`; raises KeyError for another. A TOML's says the versions by its own `format`, if any."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": identity(name)}
    if name in TOMLS:
        return {**head, "title": f"A {name.removesuffix('.toml')}'s TOML", **of_toml(_keys(name))}
    form = of_toml(_keys("tool.toml")) if name == "calibrate" else ANSWERS[name]
    return {**head, "title": f"palpate {name} --json", **_with_label(form, name)}


def _with_label(form: Form, name: str) -> Form:
    if "anyOf" in form:
        return {"anyOf": [_with_label(each, name) for each in form["anyOf"]]}
    properties = {"schema": {"const": identity(name)}, **form.get("properties", {})}
    return {**form, "properties": properties, "required": ["schema", *form.get("required", ())]}


def _keys(name: str) -> Any:
    """What `mechanics.disk.schema` checks of a TOML."""
    from palpate.importing.mapping import MAPPING
    from palpate.mechanics.effects.registry import effect_keys
    from palpate.mechanics.model import files as model
    from palpate.mechanics.recording import calibration
    from palpate.mechanics.recording import files as recording
    from palpate.scenes import scene

    return {
        "recording.toml": recording.SCHEMA,
        "model.toml": {**model.SCHEMA, "effects": effect_keys()},
        "tool.toml": calibration.SCHEMA,
        "scene.toml": scene.SCHEMA,
        "mapping.toml": MAPPING,
    }[name]
