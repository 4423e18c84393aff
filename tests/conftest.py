"""Fixtures that all tests share, and one thread of linear algebra a process."""

from __future__ import annotations

import os
import sys
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

# Set before numpy is imported, and inherited by every child. Workers side by side, each with a thread a core,
# spend more time waiting for one another in a loop than on the small systems of the tests.
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

# Modules are compiled, and their assertions rewritten, once for all workers and children, not once in each.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

from palpate.mechanics.kernel_cache import sources  # noqa: E402  mechanics chooses where kernels are kept, before a test decorates one

from .support.once import compile_one_at_a_time, folder_made_once, one_at_a_time  # noqa: E402
from .support.schemas import check_every_json  # noqa: E402

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model

WORKER = "PYTEST_XDIST_WORKER" in os.environ and os.name == "posix"
if WORKER:
    compile_one_at_a_time()
check_every_json()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Workers read the tests by turns: what the first has rewritten, the others load."""
    if not WORKER:
        return (yield)
    with one_at_a_time(Path(__file__)):
        return (yield)


REPOSITORY = Path(__file__).resolve().parents[1]


def pytest_sessionstart() -> None:
    """Stop where the installed `palpate` is not this checkout's: its tests would say nothing of it."""
    if not WORKER and (other := other_than(REPOSITORY)):
        pytest.exit(
            f"{len(other)} modules of the installed palpate differ from this checkout's ({other[0]}, ...): "
            f"remove '{REPOSITORY / 'build'}' and run '{sys.executable} -m pip install {REPOSITORY}'",
            returncode=4,
        )


@pytest.fixture(scope="session", autouse=True)
def _waits_without_a_word() -> Iterator[None]:
    """A command that a busy machine makes wait says so on standard error; tests of what it says do not."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("palpate.output.SILENT_S", 1e6)
        yield


def pytest_sessionfinish() -> None:
    """A folder of the checkout is no package: what imports it as one would load it a second time."""
    bare = {
        "mechanics",
        "reconstruct",
        "render",
        "devices",
        "diagnose",
        "scenes",
        "shell",
    } & sys.modules.keys()
    assert not bare, f"imported beside palpate: {bare}"


def other_than(clone: Path) -> list[str]:
    """Modules that the installed `palpate` and the clone do not have alike."""
    ours = {name: path.read_bytes() for name, path in modules_of(clone).items()}
    installed = {name: Path(path).read_bytes() for name, path in sources().items()}
    return sorted(name for name in ours.keys() | installed.keys() if ours.get(name) != installed.get(name))


def rooms(clone: Path) -> dict[str, str]:
    """Folder of the clone -> the package that it is installed as."""
    text = (clone / "pyproject.toml").read_text(encoding="utf-8")
    return dict(tomllib.loads(text)["tool"]["palpate"]["rooms"])


def modules_of(clone: Path) -> dict[str, Path]:
    """Dotted name -> file of every module that the clone installs."""
    return {
        ".".join([package, *path.relative_to(clone / folder).with_suffix("").parts]).removesuffix(
            ".__init__"
        ): path
        for folder, package in rooms(clone).items()
        for path in (clone / folder).rglob("*.py")
    }


def _shared(name: str, words: str) -> Path:
    folder = Path(os.environ.get("PALPATE_SHARED", REPOSITORY.parent / "shared")) / name
    if not folder.is_dir():
        pytest.skip(f"the {words} are not beside the checkout (set PALPATE_SHARED)")
    return folder


@pytest.fixture(scope="session")
def shared_recordings() -> Path:
    """The folder of labelled recordings beside the checkout; tests that need it are skipped without it."""
    return _shared("recordings", "labelled recordings")


@pytest.fixture(scope="session")
def reconstructed(
    shared_recordings: Path, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Model]:
    """The MODEL of a labelled recording by default options: each is made once."""
    from palpate.mechanics.model.files import read_model, write_model
    from palpate.mechanics.recording.recording import read_recording
    from palpate.reconstruction.pipeline import reconstruct

    def model(name: str) -> Model:
        def make(folder: Path) -> None:
            write_model(folder / "MODEL", reconstruct(read_recording(shared_recordings / f"{name}.toml")))

        return read_model(folder_made_once(tmp_path_factory, f"reconstructed-{name}", make) / "MODEL")

    return model


@pytest.fixture(scope="session")
def measured_data() -> Path:
    """The folder of other people's measurements beside the checkout; the same."""
    return _shared("realdata", "measurements")


@pytest.fixture(scope="session")
def strangers() -> Path:
    """The folder of files that nobody here had tried, with the right answers in their notes; the same."""
    return _shared("strangers", "strangers' files")


@pytest.fixture(scope="session")
def block_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A block of 30 kPa, 60 x 60 x 30 mm, its base at z = 0, as a MODEL folder with its compliance and the
    stiffness of its surface; only to be read."""
    from palpate.mechanics.model.files import read_model, write_model
    from palpate.render.registry import create
    from palpate.render.surface.felt_surface import with_own_stiffness

    from .render import shapes

    def make(folder: Path) -> None:
        path = write_model(folder / "block", shapes.model(shapes.block((0.06, 0.06, 0.03), (4, 4, 2))))
        with_own_stiffness(create("fem", read_model(path)))

    return folder_made_once(tmp_path_factory, "block", make) / "block"


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """For a page of which only the words are read: nothing is drawn."""
    monkeypatch.setattr("palpate.show.page.png_and_drawing", lambda picture: (bytes(24), ""))


@pytest.fixture
def nothing_to_press(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports do not carry the page of their object: seconds each, and tested in tests/shell/exporting."""
    monkeypatch.setattr("palpate.exporting.page.document.button", lambda model: "")
