"""A hint names libraries that any index has, as pyproject.toml states them."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from palpate.mechanics.errors import PalpateError
from palpate.mechanics.extras import install_words, libraries
from palpate.render.simulators.base import missing
from palpate.render.simulators.mujoco import MuJoCo

from ..conftest import REPOSITORY

PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
EXTRAS, DEPENDENCIES = PROJECT["optional-dependencies"], PROJECT["dependencies"]


def _same(line: str) -> str:
    return "".join(sorted(re.split(r"[,\s]*", line.replace(" ", ""))))


@pytest.mark.parametrize("extra", ["import", "haply", "mujoco", "newton", "cluster"])
def test_a_hint_names_the_libraries_of_its_extra(extra):
    assert sorted(map(_same, libraries(extra))) == sorted(map(_same, EXTRAS[extra]))
    words = install_words(extra)
    assert all(f"'{line}'" in words for line in libraries(extra)) and "palpate[" not in words


@pytest.mark.parametrize(
    ("extra", "module", "words"),
    [
        ("import", "h5py", "pip install 'h5py>=3.8'"),
        ("import", "python_calamine", "pip install 'python-calamine>=0.2'"),
        ("import", "rosbags.highlevel", "pip install 'rosbags>=0.10'"),
        ("cluster", "distributed", "pip install 'dask[distributed]>=2024.8'"),
        ("nothing", "h5py", "pip install 'h5py'"),
    ],
)
def test_of_a_missing_module_its_library_is_named(extra, module, words):
    assert install_words(extra, module) == words


def test_a_simulator_that_is_missing_is_installed_from_anywhere():
    error = missing(MuJoCo, ModuleNotFoundError(name="mujoco"))
    assert isinstance(error, PalpateError) and "pip install 'mujoco>=3'" in str(error)


NAMES = {re.match(r"[\w.-]+", line)[0] for lines in [*EXTRAS.values(), DEPENDENCIES] for line in lines}
"""Of libraries that pyproject.toml asks for."""
HINT = re.compile(r"pip install ((?:(?:'[^'\n]+'|[a-z][\w.\[\]-]*)(?: |(?=[`\x22\n);,]|$)))+)")


def hints() -> list[tuple[str, str]]:
    """(file, what it installs) of each `pip install` of the program and of the pages that a user reads; none
    installs the clone itself, and pages of those who develop it are not meant."""
    rooms = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["palpate"]["rooms"]
    files = [p for room in rooms for p in (REPOSITORY / room).rglob("*.py")]
    files += [
        p
        for p in (REPOSITORY / "docs").rglob("*.md")
        if not {"develop", "decisions", "generated"} & set(p.parts)
    ]
    return [(str(p), found) for p in files for found in HINT.findall(p.read_text(encoding="utf-8"))]


def test_every_hint_names_libraries_which_any_index_has_from_a_clone_and_a_wheel_alike():
    found = hints()
    assert len(found) > 6
    for file, words in found:
        for each in words.replace("'", "").split():
            assert each.partition("[")[0] in NAMES, f"{file}: pip install {words}"
    extras = "|".join(EXTRAS)
    rooms = [p for p, _ in found if p.endswith(".md")]
    assert not [
        p for p in rooms if re.search(rf"(palpate|\.)\[({extras})", Path(p).read_text(encoding="utf-8"))
    ]


@pytest.mark.parametrize("extra", ["import", "mcap", "cluster"])
def test_the_install_page_names_all_of_an_extra(extra):
    said = " ".join(words for file, words in hints() if file.endswith("install.md"))
    page = (REPOSITORY / "docs" / "tutorials" / "install.md").read_text(encoding="utf-8")
    assert all(re.match(r"[\w.-]+", line)[0] in said for line in EXTRAS[extra]), said
    assert "rerun-sdk" in page
