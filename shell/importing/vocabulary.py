"""What the name of a column says of it, by the words of vocabulary.toml."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

_AXES = {"x": "x|0", "y": "y|1", "z": "z|2"}


@lru_cache(maxsize=1)
def vocabulary() -> Mapping[str, Any]:
    """The tables of vocabulary.toml."""
    return tomllib.loads(Path(__file__).with_name("vocabulary.toml").read_text(encoding="utf-8"))


@lru_cache(maxsize=16)
def says(role: str) -> re.Pattern[str]:
    """What the letters and digits of a whole name match that says the role."""
    held = vocabulary()
    if role == "t":
        return re.compile("|".join(held["time"]["names"]))
    words = held["words"]
    body, nothing = "|".join(words["body"]), "|".join(words["nothing"])
    exactly = [role, *held["exactly"].get(role, [])]
    if role.startswith("q"):
        own, other, axes = "|".join(words["quaternion"]), f"{body}|{nothing}", f"{role}|{role[1]}"
    elif role.startswith("f"):
        own, other, axes = "|".join(words["force"]), f"{body}|{nothing}", _AXES[role[1]]
    else:
        own, other, axes = "|".join([*words["position"], body]), nothing, _AXES[role]
    return re.compile(f"{'|'.join(exactly)}|(?:{other})*(?:{own})(?:{own}|{other})*(?:{axes})")
