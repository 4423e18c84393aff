"""Options: one frozen dataclass a step; the command line is generated from its fields.

@dataclass(frozen=True) class MeshingOptions:
    mesh_size_m: float = option(0.010, "edge length of the tetrahedra", unit="m", flag="--mesh-size")
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any


def option(
    default: Any,
    help: str,
    *,
    unit: str = "",
    flag: str | None = None,
    choices: Sequence[str] | None = None,
) -> Any:
    """A dataclass field with the words that the command line prints for it.

    `flag` defaults to `--field-name`; `choices` restricts a string. A boolean becomes `--flag/--no-flag`.
    A field whose default is None takes a float unless `choices` is given.
    """
    metadata = {"help": help, "unit": unit, "flag": flag, "choices": tuple(choices) if choices else None}
    return dataclasses.field(default=default, metadata=metadata)
