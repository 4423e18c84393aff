"""Compiled kernels on disk: a changed callee is seen, everybody's folder is the same, the user's own wins."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import mechanics
from mechanics.kernel_cache import PACKAGES, kernel_sources, source_key

ROOT = Path(mechanics.__file__).parents[1]

CALLEE = """
from numba import njit
from mechanics.number import FACTOR
@njit(cache=True)
def callee(x):
    return FACTOR * x
"""
CALLER = """
from numba import njit
from mechanics.callee import callee
@njit(cache=True)
def caller(x):
    return callee(x) + 1.0
"""


def run(code: str, root: Path, cache: Path, **variables: str) -> str:
    """What Python prints that finds our packages in `root` and the user's cache at `cache`."""
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment |= {"PYTHONPATH": str(root), "PALPATE_CACHE": str(cache), **variables}
    done = subprocess.run([sys.executable, "-P", "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the mechanics room with a kernel that calls another, which takes a number from a third."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "mechanics", tmp_path / "code/mechanics", ignore=ignored)
    for name, text in (("number", "FACTOR = 2.0\n"), ("callee", CALLEE), ("caller", CALLER)):
        (tmp_path / f"code/mechanics/{name}.py").write_text(text)
    return tmp_path / "code"


def test_a_changed_callee_and_a_changed_number_are_seen(copy: Path, tmp_path: Path) -> None:
    code = (
        "from mechanics.caller import caller; value = caller(3.0); "
        "print(value, sum(caller.stats.cache_hits.values()))"
    )
    assert run(code, copy, tmp_path / "cache") == "7.0 0"
    assert run(code, copy, tmp_path / "cache") == "7.0 1"  # taken from disk while nothing changes
    (copy / "mechanics/callee.py").write_text(CALLEE.replace("FACTOR * x", "FACTOR * x * x"))
    assert run(code, copy, tmp_path / "cache") == "19.0 0"
    (copy / "mechanics/number.py").write_text("FACTOR = 5.0\n")
    assert run(code, copy, tmp_path / "cache") == "46.0 0"


MODULES = ("mechanics.contact.dent", "render.support", "devices.safety", "diagnose.forward.kernel",
           "scenes.laboratory.laws", "palpate.servo.clock")  # fmt: skip


@pytest.mark.parametrize("first, modules", [("", [m]) for m in MODULES] + [("import numba; ", MODULES)])
def test_every_package_keeps_its_kernels_there(first: str, modules: list[str], tmp_path: Path) -> None:
    # a kernel that is woven at import has no file of its own; its callers' caches hold it
    code = f"""
{first}import importlib
for name in {modules}:
    module = importlib.import_module(name)
    import numba
    kernels = [v for v in vars(module).values() if isinstance(v, numba.core.registry.CPUDispatcher)]
    print(name, *{{v._cache._cache_path for v in kernels if hasattr(v._cache, "_cache_path")}})
"""
    folder = tmp_path / "kernels" / source_key(ROOT)
    lines = [line.split() for line in run(code, ROOT, tmp_path).splitlines()]
    assert [name for name, *_ in lines] == list(modules)
    for _, *used in lines:
        assert used and all(Path(path).parent == folder for path in used)


def test_every_kernel_of_ours_counts(tmp_path: Path) -> None:
    code = """
import gc, importlib, inspect, pkgutil, numba
from mechanics.kernel_cache import PACKAGES
for package in map(importlib.import_module, PACKAGES):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not found.name.endswith("__main__"):
            try:
                importlib.import_module(found.name)
            except ImportError:
                pass  # an extra that is not installed
kernels = [o.py_func for o in gc.get_objects() if type(o) is numba.core.registry.CPUDispatcher]
ours = [f for f in kernels if f.__module__.split(".")[0] in PACKAGES]
print(*sorted({inspect.getsourcefile(f) for f in ours}), sep=chr(10))
"""
    files = run(code, ROOT, tmp_path).splitlines()
    assert len(files) > 25
    assert set(files) <= set(kernel_sources(ROOT))


def test_the_users_own_folder_wins_but_not_a_parents(tmp_path: Path) -> None:
    code = "import mechanics, numba; print(numba.config.CACHE_DIR)"
    ours = tmp_path / "kernels"
    assert run(code, ROOT, tmp_path, NUMBA_CACHE_DIR="/tmp/elsewhere") == "/tmp/elsewhere"
    by_hand = "import numba; numba.config.CACHE_DIR = '/tmp/by-hand'; "
    assert run(by_hand + code, ROOT, tmp_path) == "/tmp/by-hand"
    assert run(code, ROOT, tmp_path, NUMBA_CACHE_DIR=str(ours / "0123")) == str(ours / source_key(ROOT))


def test_the_default_stays_where_the_cache_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    assert run("import mechanics, numba; print(numba.config.CACHE_DIR)", ROOT, tmp_path / "file") == ""


def test_old_folders_go_and_the_newest_stay(tmp_path: Path) -> None:
    kernels = tmp_path / "kernels"
    for age in range(9):
        folder = kernels / f"old{age}"
        folder.mkdir(parents=True)
        os.utime(folder, (1e9 - age, 1e9 - age))
    run("import mechanics", ROOT, tmp_path)
    assert {p.name for p in kernels.iterdir()} == {source_key(ROOT), "old0", "old1", "old2", "old3", "old4"}


def test_only_sources_of_kernels_and_what_they_import_count(tmp_path: Path) -> None:
    for package in PACKAGES:
        ignored = shutil.ignore_patterns("__pycache__", "*.gz", "*.npz")
        shutil.copytree(ROOT / package, tmp_path / package, ignore=ignored)
    assert source_key(tmp_path) == source_key(ROOT)
    (tmp_path / "palpate/cli.py").write_text("# nothing that a kernel knows of")
    assert source_key(tmp_path) == source_key(ROOT)
    with open(tmp_path / "mechanics/contact/dent.py", "a") as file:
        file.write("# changed\n")
    assert source_key(tmp_path) != source_key(ROOT)
