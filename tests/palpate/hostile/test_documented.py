"""The pages of the docs that name tests name tests that exist."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from . import test_command_lines, test_curves, test_models_and_scenes, test_recordings, test_robot

TABLES = (test_command_lines, test_curves, test_models_and_scenes, test_recordings, test_robot)
NAMED = re.compile(r"`([A-Z]+)\[((?:[^\]\\]|\\.)+)\]`|`(test_\w+)`")


@pytest.mark.parametrize(("page", "least"), [("robustness.md", 120), ("safety.md", 15)])
def test_every_row_of_the_docs_names_tests_that_exist(page, least):
    from ...support.faults import FAULTS

    root, defined = Path(__file__).resolve().parents[3], set()
    tables = {key: value for module in TABLES for key, value in vars(module).items() if key.isupper()}
    for file in (root / "tests").rglob("test_*.py"):
        defined |= set(re.findall(r"^def (test_\w+)", file.read_text(encoding="utf-8"), re.MULTILINE))
    named = NAMED.findall((root / "docs" / page).read_text(encoding="utf-8"))
    assert len(named) >= least
    for table, key, name in named:
        rows = FAULTS if table == "FAULTS" else tables[table] if table else defined
        assert (name or key.replace("\\", "")) in rows, f"{table or page} has no '{name or key}'"
