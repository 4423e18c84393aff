"""What is asked of other packages: each has a lowest version, which what is installed here is not below.

That the lowest versions do is tried by `.ci/release`.
"""

from __future__ import annotations

import re
import tomllib
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).resolve().parents[2] / "pyproject.toml").read_text("utf-8"))[
    "project"
]
REQUIRED = [
    *PROJECT["dependencies"],
    *(r for group in PROJECT["optional-dependencies"].values() for r in group),
]


def numbers(text: str) -> list[int]:
    """A version's numbers."""
    return [int(number) for number in re.findall(r"\d+", text)[:3]]


def test_every_package_has_a_lowest_version_and_here_is_none_below_it():
    for line in REQUIRED:
        found = re.match(r"([A-Za-z0-9_.-]+)(?:\[[^\]]*\])?\s*>=\s*([0-9.]+)", line)
        assert found, f"'{line}' states no lowest version"
        try:
            here = version(found[1])
        except PackageNotFoundError:
            continue
        assert numbers(here) >= numbers(found[2]), f"{found[1]} {here}"
