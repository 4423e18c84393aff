"""The one import: light, whole, documented, the same for type checkers as at run time."""

from __future__ import annotations

import ast
import inspect
import pkgutil
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import palpate as pp

REPOSITORY = Path(__file__).resolve().parents[3]
FUNCTIONS = [n for n in dir(pp) if inspect.isfunction(getattr(pp, n))]
RESULTS = [n for n in dir(pp) if inspect.isclass(getattr(pp, n)) and hasattr(getattr(pp, n), "lines")]
ERRORS = [n for n in dir(pp) if n.endswith("Error")]
UNITS = re.compile(r"\b(m|mm|s|N|Pa|Hz|m/s|1 kHz|\[unit\])\b")


def test_import_loads_nothing_heavy():
    heavy = ("numpy", "scipy", "numba", "matplotlib", "pyvista", "vtk", "trimesh", "argparse")
    words = f"import sys, palpate as pp; dir(pp); print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-P", "-c", words], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


def test_door_is_what_was_promised():
    promised = "read_recording reconstruct load renderer replay press compare diagnose simulate batch "
    promised += "check import_table read_table model_of export options material calibrate changes "
    promised += "open recording conformance touch tune"
    assert set(FUNCTIONS) == set(promised.split())
    assert set(RESULTS) == set(
        "Recording Model Reconstruction ReplayResult Curve Comparison Diagnosis Simulation Batch "
        "Checkup Imported Opened Material Calibration Changes SimulatedGap Tuned".split()
    )
    assert all(issubclass(getattr(pp, name), pp.PalpateError) for name in ERRORS)
    with pytest.raises(AttributeError, match="no attribute 'replay_recording'.*replay"):
        pp.replay_recording  # noqa: B018


def test_no_module_takes_the_place_of_a_name_of_the_door():
    """Importing a submodule sets it on its package: `palpate/press.py` would hide `pp.press`."""
    assert not {m.name for m in pkgutil.iter_modules(pp.__path__)} & set(dir(pp))


def test_every_error_of_the_rooms_is_at_the_door():
    from palpate.mechanics import errors

    raised = {
        n for n, value in vars(errors).items() if inspect.isclass(value) and issubclass(value, Exception)
    }
    assert raised - {n for n in raised if issubclass(getattr(errors, n), Warning)} == set(ERRORS)


def test_type_checkers_see_the_names_that_run_time_has():
    tree = ast.parse((REPOSITORY / "shell" / "__init__.py").read_text())
    guarded = next(n for n in tree.body if isinstance(n, ast.If))
    seen = {a.asname: n.module for n in guarded.body if isinstance(n, ast.ImportFrom) for a in n.names}
    assert seen == pp._HOME
    assert set(dir(pp)) == set(pp.__all__) == {*seen, "__version__"}


def test_the_package_says_that_it_is_typed():
    table = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())
    assert "py.typed" in table["tool"]["setuptools"]["package-data"]["*"]
    assert (REPOSITORY / "shell" / "py.typed").is_file()


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_documents_its_arguments_with_units(name):
    function = getattr(pp, name)
    words = inspect.getdoc(function)
    assert UNITS.search(words) or name == "options"
    assert "Raises" in words
    every = inspect.signature(function).parameters.values()
    common = {"progress", "seed", "recording", "phantom"}
    missing = [p.name for p in every if p.name not in words and p.name not in common]
    assert not missing
    assert all(p.annotation is not p.empty for p in every)


@pytest.mark.parametrize("name", RESULTS)
def test_every_result_documents_its_units_plot_and_scene(name):
    kind = getattr(pp, name)
    words = inspect.getdoc(kind)
    assert UNITS.search(words) and "`plot`" in words and "`show`" in words
    own = [m for n, m in vars(kind).items() if not n.startswith("_") and (callable(m) or type(m) is property)]
    assert all(inspect.getdoc(member) for member in own)


@pytest.mark.parametrize("name", [*FUNCTIONS, *RESULTS])
def test_the_page_names_it(name):
    assert f"pp.{name}" in (REPOSITORY / "docs" / "reference" / "python.md").read_text()


def test_script_without_a_main_guard_runs_once(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from palpate.scenes.laboratory.curves import workers_of_ours\n"
        "print('begun')\n"
        "with workers_of_ours(2) as pool:\n"
        "    print(sorted(f.result() for f in [pool.submit(abs, -k) for k in range(4)]))\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout == "begun\n[0, 1, 2, 3]\n", done.stderr
