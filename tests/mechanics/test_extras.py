"""A hint names libraries that any index has, as pyproject.toml states them."""

from __future__ import annotations

import re
import tomllib

import pytest

from palpate.mechanics.errors import PalpateError
from palpate.mechanics.extras import install_words, libraries
from palpate.render.simulators.base import missing
from palpate.render.simulators.mujoco import MuJoCo

from ..conftest import REPOSITORY

EXTRAS = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["optional-dependencies"]


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


def test_no_hint_names_an_extra_of_a_package_that_no_index_has():
    rooms = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["tool"]["palpate"]["rooms"]
    said = [p for room in rooms for p in (REPOSITORY / room).rglob("*.py") if "'palpate[" in p.read_text()]
    assert not said
