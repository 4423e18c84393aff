"""What is installed is one name, whose parts are found wherever one stands."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
import sysconfig
from importlib.metadata import Distribution, distributions
from pathlib import Path

import pytest

import palpate as pp
from palpate.mechanics.kernel_cache import ROOMS, sources

from ..conftest import REPOSITORY, modules_of, rooms

EXTRAS = {"palpate.render.simulators.drake_scene", "palpate.render.simulators.newton_scene"}
"""Modules that need a library which the tests do without."""


def recorded() -> list[str]:
    """The files that the installation recorded; the test is skipped where it is an editable one."""
    found: Distribution = next(iter(distributions(name="palpate", path=[sysconfig.get_path("purelib")])))
    names = [str(file) for file in found.files or ()]
    if any("__editable__" in name for name in names):
        pytest.skip("an editable installation records none of its files")
    return names


def test_one_name_is_installed():
    tops = {name.split("/")[0] for name in recorded() if not name.startswith("..")}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"palpate"}


def test_every_module_and_file_of_the_clone_is_installed():
    installed = {name for name in recorded() if name.startswith("palpate/") and "__pycache__" not in name}
    words = ["git", "-C", str(REPOSITORY), "ls-files", "--", *rooms(REPOSITORY)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        pytest.skip("not a clone")
    homes = {folder: package.replace(".", "/") for folder, package in rooms(REPOSITORY).items()}
    tracked = {f"{homes[top]}/{rest}" for top, _, rest in (n.partition("/") for n in done.stdout.split())}
    kit = "palpate/scenes/conformance/README.md"  # is written into each kit
    assert installed == {name for name in tracked if not name.endswith(".md") or name == kit}


def test_every_room_is_known_to_who_looks_for_sources():
    assert sources().keys() == modules_of(REPOSITORY).keys()
    assert {f"palpate.{room}" for room in ROOMS} <= sources().keys()


def test_files_beside_a_script_do_not_shadow_the_program(tmp_path):
    for name in rooms(REPOSITORY):
        (tmp_path / f"{name}.py").write_text("raise ImportError('taken from beside the script')\n")
    (tmp_path / "script.py").write_text(
        "import palpate as pp\n"
        "curve = pp.press('nodule', at=(0, 0, 0.05), depth_m=0.002, progress=False)\n"
        "print(curve.force_at(0.002)[2] > 0.01)\n"
    )
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == "True", done.stderr


def test_no_part_of_the_program_hides_a_function_of_the_same_name():
    """`palpate.press` is a function: were there a module of that name, importing it would replace it."""
    for name in sources():
        if not name.endswith("__main__") and name not in EXTRAS and ".conformance.adapters." not in name:
            importlib.import_module(name)
    for name in pp._calls():
        assert hasattr(getattr(pp, name), "operation") or name == "options", name


def test_modules_that_are_named_in_words_are_there():
    """Registries name modules in strings, so that nothing is loaded before it is used."""
    known = sources()
    named = re.compile(r"""["'](palpate(?:\.\w+)+)(?::(\w+))?["']""")
    found = {m for path in known.values() for m in named.findall(Path(path).read_text(encoding="utf-8"))}
    assert len(found) > 60
    for module, attribute in sorted(found):
        if module in known:
            if attribute and module not in EXTRAS:
                assert hasattr(importlib.import_module(module), attribute), (module, attribute)
        else:  # an attribute of a module
            home, _, name = module.rpartition(".")
            assert home in known and hasattr(importlib.import_module(home), name), module
