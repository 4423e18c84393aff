"""A class's name means one thing in the whole program."""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

ROOMS = ("mechanics", "reconstruct", "render", "devices", "diagnose", "scenes", "shell")
ADAPTERS = ("render/simulators/",)
"""Each simulator's scene and touch answer to the same names: they are put into an exported script as they
stand."""


def test_no_class_name_is_defined_twice():
    root = Path(__file__).parents[1]
    places = defaultdict(list)
    for path in (p for room in ROOMS for p in sorted((root / room).rglob("*.py"))):
        here = path.relative_to(root).as_posix()
        if not here.startswith(ADAPTERS):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.ClassDef):
                    places[node.name].append(here)
    assert {name: files for name, files in places.items() if len(files) > 1} == {}
