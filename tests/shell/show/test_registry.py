"""A result is added in one file, and every type is shown by a module that is there."""

from __future__ import annotations

import ast
import importlib
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from matplotlib.image import imread

from palpate import show
from palpate.mechanics.errors import OptionError
from palpate.mechanics.result import Result
from palpate.show.story import Headline, Next, Title


@dataclass(frozen=True, eq=False, repr=False)
class Weighed(Result):
    """mass_kg: what a scale read; places (n, 3) m: where it stood."""

    mass_kg: float
    places: np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class Tared(Weighed):
    """The same, less what lay on the scale before."""


def _module() -> ModuleType:
    """What `shell/show/weighed.py` would hold."""
    from palpate.show.scenery import add_dots, look_around

    module = ModuleType("weighed")

    def story(result):
        yield Title("Weighed")
        yield Headline(f"{1e3 * result.mass_kg:.0f} g")
        yield Next(["weigh it again"])

    def draw(result, ax):
        ax.bar(["mass"], [result.mass_kg])
        ax.set_ylabel("mass [kg]")

    def place(result, plotter):
        add_dots(plotter, result.places)
        look_around(plotter, np.array([0.0, 0.0, 1.0]), result.places)

    for function in (story, draw, place):
        setattr(module, function.__name__, function)
    vars(module)["KEYS"] = ("mass_kg",)
    return module


@pytest.fixture
def weighed(monkeypatch):
    monkeypatch.setattr(show, "_KINDS", dict(show._KINDS))
    show.register(Weighed, _module())
    return Weighed(0.25, np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]]))


def test_a_new_result_prints_plots_shows_and_reports(weighed, tmp_path):
    assert str(weighed) == repr(weighed) == "250 g"
    assert json.dumps(weighed.as_json()) == '{"mass_kg": 0.25}'
    ax = weighed.plot()
    assert ax.get_ylabel() == "mass [kg]" and ax.patches[0].get_height() == 0.25
    weighed.show(screenshot=tmp_path / "scene.png")
    assert np.ptp(imread(tmp_path / "scene.png")[..., :3]) > 0.2
    written = weighed.report(tmp_path / "page.html").read_text()
    assert '<p class="lead">250 g.</p>' in written and "What to do next: weigh it again." in written
    assert show.next_lines(weighed) == ["next: weigh it again"]
    page = weighed._repr_html_()
    assert "<pre>250 g</pre>" in page and "data:image/png;base64," in page
    assert weighed.view() is None


def test_what_derives_from_a_result_is_shown_as_it(weighed):
    assert str(Tared(0.2, weighed.places)) == "200 g"


def test_what_a_result_has_not_is_said(weighed, monkeypatch):
    bare = ModuleType("bare")
    monkeypatch.setattr(show, "_KINDS", {})
    with pytest.raises(OptionError, match=r"no module shows a Weighed: .*register\(Weighed, module\)"):
        weighed.plot()
    show.register(Weighed, bare)
    with pytest.raises(OptionError, match="a Weighed has no place in space: use .plot()"):
        weighed.show()
    with pytest.raises(OptionError, match="a Weighed has no page"):
        weighed.report("page.html")


@pytest.mark.parametrize("kind, module", show._KINDS.items())
def test_every_kind_of_result_is_there_and_shown(kind, module):
    home, _, name = kind.rpartition(".")
    found = getattr(importlib.import_module(home), name)
    assert issubclass(found, Result)
    shown = module if isinstance(module, ModuleType) else importlib.import_module(f"palpate.show.{module}")
    assert callable(getattr(shown, "draw", None)) or shown.SHOWN_AS in {
        *found.__annotations__, *dir(found),
    }  # fmt: skip
    assert hasattr(shown, "story") or found.lines is not Result.lines


def test_without_palpate_a_result_prints_its_numbers_and_says_what_to_import():
    words = (
        "import sys\n"
        "from palpate.mechanics.recording.calibration import Calibration\n"
        "made = Calibration(tip_radius_m=0.005)\n"
        "print(made)\n"
        "try:\n"
        "    made.plot()\n"
        "except Exception as error:\n"
        "    print(error)\n"
        "print([m for m in ('matplotlib', 'pyvista', 'palpate.show') if m in sys.modules])\n"
        "import palpate.show\n"
        "print(made)\n"
    )
    done = subprocess.run([sys.executable, "-P", "-c", words], capture_output=True, text=True)
    plain, error, loaded, *shown = done.stdout.splitlines()
    assert plain == "Calibration: tip_radius_m = 0.005"
    assert error == "a Calibration is drawn by palpate: `import palpate.show` first"
    assert loaded == "[]"
    assert "  tip's radius: 5 mm" in shown, done.stderr


def test_only_drawing_loads_what_draws():
    """A command that prints lines waits for neither matplotlib nor PyVista."""
    found = []
    for path in Path(show.__file__).parent.rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for node in tree.body:
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            else:
                names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            found += [
                f"{path.name}: {n}" for n in names if n.partition(".")[0] in ("matplotlib", "pyvista", "vtk")
            ]
    assert not found
