"""Compiled kernels on disk: a changed callee is seen, everybody's folder is the same, the user's own wins."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from palpate.mechanics.kernel_cache import ROOMS, kernel_sources, source_key, sources

CALLEE = """
from numba import njit
from palpate.mechanics.number import FACTOR
@njit(cache=True)
def callee(x):
    return FACTOR * x
"""
CALLER = """
from numba import njit
from palpate.mechanics.callee import callee
@njit(cache=True)
def caller(x):
    return callee(x) + 1.0
"""


def run(code: str, cache: Path, *first: str, **variables: str) -> str:
    """What Python prints that has the user's cache at `cache`; first: folders that it searches first."""
    environment = {k: v for k, v in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment |= {"PALPATE_CACHE": str(cache), **variables}
    # an editable installation's finder comes before the path: it goes where a copy is to be found
    search = f"import sys; sys.path[:0] = {list(first)}; "
    search += (
        "sys.meta_path[:] = [f for f in sys.meta_path if 'editable' not in getattr(f, '__module__', '')]; "
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", (search if first else "") + code],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """The folder of a copy of `palpate` as it is installed."""
    root = tmp_path / "code"
    for name, path in sources().items():
        to = root.joinpath(*name.split("."))
        to = to / "__init__.py" if Path(path).name == "__init__.py" else to.with_suffix(".py")
        to.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, to)
    return root


@pytest.fixture
def chain(copy: Path) -> Path:
    """The same, with a kernel that calls another, which takes a number from a third."""
    for name, text in (("number", "FACTOR = 2.0\n"), ("callee", CALLEE), ("caller", CALLER)):
        (copy / f"palpate/mechanics/{name}.py").write_text(text)
    return copy


def test_a_changed_callee_and_a_changed_number_are_seen(chain: Path, tmp_path: Path) -> None:
    code = (
        "from palpate.mechanics.caller import caller; value = caller(3.0); "
        "print(value, sum(caller.stats.cache_hits.values()))"
    )
    cache = tmp_path / "cache"
    assert run(code, cache, str(chain)) == "7.0 0"
    assert run(code, cache, str(chain)) == "7.0 1"  # taken from disk while nothing changes
    (chain / "palpate/mechanics/callee.py").write_text(CALLEE.replace("FACTOR * x", "FACTOR * x * x"))
    assert run(code, cache, str(chain)) == "19.0 0"
    (chain / "palpate/mechanics/number.py").write_text("FACTOR = 5.0\n")
    assert run(code, cache, str(chain)) == "46.0 0"


MODULES = (
    "palpate.mechanics.contact.dent",
    "palpate.render.support",
    "palpate.devices.safety",
    "palpate.diagnosis.forward.kernel",
    "palpate.scenes.laboratory.laws",
    "palpate.servo.clock",
)


@pytest.mark.parametrize("first, modules", [("", [m]) for m in MODULES[1::4]] + [("import numba; ", MODULES)])
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
    folder = tmp_path / "kernels" / source_key(sources())
    lines = [line.split() for line in run(code, tmp_path).splitlines()]
    assert [name for name, *_ in lines] == list(modules)
    for _, *used in lines:
        assert used and all(Path(path).parent == folder for path in used)


def test_every_kernel_of_ours_counts(tmp_path: Path) -> None:
    code = """
import gc, importlib, numba
from palpate.mechanics.kernel_cache import sources
for name in sources():
    if not name.endswith("__main__"):
        try:
            importlib.import_module(name)
        except ImportError:
            pass  # an extra that is not installed
kernels = [o.py_func for o in gc.get_objects() if type(o) is numba.core.registry.CPUDispatcher]
print(*sorted({f.__module__ for f in kernels if f.__module__.startswith("palpate.")}), sep=chr(10))
"""
    modules = run(code, tmp_path).splitlines()
    assert len(modules) > 25
    assert set(modules) <= set(kernel_sources(sources()))
    assert {module.split(".")[1] for module in modules} >= {*ROOMS, "servo"} - {"reconstruction"}


def test_the_users_own_folder_wins_but_not_a_parents(tmp_path: Path) -> None:
    code = "import palpate.mechanics, numba; print(numba.config.CACHE_DIR)"
    ours = tmp_path / "kernels"
    assert run(code, tmp_path, NUMBA_CACHE_DIR="/tmp/elsewhere") == "/tmp/elsewhere"
    by_hand = "import numba; numba.config.CACHE_DIR = '/tmp/by-hand'; "
    assert run(by_hand + code, tmp_path) == "/tmp/by-hand"
    assert run(code, tmp_path, NUMBA_CACHE_DIR=str(ours / "0123")) == str(ours / source_key(sources()))


def test_the_default_stays_where_the_cache_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    assert run("import palpate.mechanics, numba; print(numba.config.CACHE_DIR)", tmp_path / "file") == ""


def test_old_folders_go_and_the_newest_stay(tmp_path: Path) -> None:
    kernels = tmp_path / "kernels"
    for age in range(9):
        folder = kernels / f"old{age}"
        folder.mkdir(parents=True)
        os.utime(folder, (1e9 - age, 1e9 - age))
    run("import palpate.mechanics", tmp_path)
    assert {p.name for p in kernels.iterdir()} == {
        source_key(sources()),
        "old0",
        "old1",
        "old2",
        "old3",
        "old4",
    }


def test_only_sources_of_kernels_and_what_they_import_count(copy: Path) -> None:
    copied = {
        name: str(copy.joinpath(*name.split(".")) / "__init__.py" if Path(path).name == "__init__.py"
                  else copy.joinpath(*name.split(".")).with_suffix(".py"))
        for name, path in sources().items()
    }  # fmt: skip
    assert source_key(copied) == source_key(sources())
    Path(copied["palpate.cli"]).write_text("# nothing that a kernel knows of")
    assert source_key(copied) == source_key(sources())
    with open(copied["palpate.mechanics.contact.dent"], "a") as file:
        file.write("# changed\n")
    assert source_key(copied) != source_key(sources())


def test_a_constant_of_another_room_counts(copy: Path) -> None:
    """A number that a kernel of one room takes from a module of another that holds no kernel."""
    folder = copy / "palpate"
    (folder / "scenes/number.py").write_text("FACTOR = 2.0\n")
    with open(folder / "render/support.py", "a") as file:
        file.write("\nfrom palpate.scenes.number import FACTOR\n")
    modules = sources() | {
        "palpate.scenes.number": str(folder / "scenes/number.py"),
        "palpate.render.support": str(folder / "render/support.py"),
    }
    before = source_key(modules)
    (folder / "scenes/number.py").write_text("FACTOR = 3.0\n")
    assert source_key(modules) != before
