"""A real notebook, executed without a screen: results show themselves with the view of the pages, and what is
touched is a page to press."""

from __future__ import annotations

from pathlib import Path

import nbclient
import pytest

from .browser import a_tab, browser_found
from .frames import page_in

CELLS = (
    "import numpy as np\n"
    "import palpate as pp\n"
    "from palpate.mechanics.shape.tetmesh import box_mesh\n"
    "from palpate.mechanics.model.material import ObjectMaterial\n"
    "from palpate.mechanics.model.model import Model, Support, Tool\n"
    "support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]))\n"
    "mesh = box_mesh((4, 4, 2), (0.06, 0.06, 0.03)).quadratic()\n"
    "pp.Model\n"
    "model = Model(mesh, ObjectMaterial(20e3, 0.49), support, Tool(0.005), mesh_size_m=0.015)",
    "model",
    "model.show()",
    "pp.press(model, at=(0, 0, 0.03), depth_m=0.002)",
    "pp.touch(model)",
    "try:\n    pp.touch(model, record='a.csv.gz')\nexcept pp.OptionError as error:\n    print(error)",
)
MOST_BYTES = 1_500_000
"""Of a cell's output: three.js and an object, packed."""


@pytest.fixture(scope="module")
def executed():
    from nbformat import v4

    notebook = v4.new_notebook(cells=[v4.new_code_cell(text) for text in CELLS])
    notebook.metadata.kernelspec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return nbclient.NotebookClient(notebook, timeout=300).execute()


@pytest.mark.slow
def test_a_result_shows_itself_and_its_show_is_the_view_of_the_pages(executed):
    _, itself, shown, curve, touched, refused = (cell.outputs for cell in executed.cells)
    for outputs, words in ((itself, "20.00 kPa"), (curve, "N at most")):
        own = next(o.data["text/html"] for o in outputs if o.output_type == "execute_result")
        assert words in own and "data:image/png;base64" in own and 'class="view3d"' in page_in(own)
        assert len(own) < MOST_BYTES
    assert [output.output_type for output in shown] == ["display_data"], "no warning, no None, no bitmap"
    assert 'class="view3d"' in page_in(shown[0].data["text/html"])
    pressed = [o.data["text/html"] for o in touched if o.output_type == "display_data"]
    assert len(pressed) == 1 and "window.palpate" in page_in(pressed[0]) and len(pressed[0]) < MOST_BYTES
    assert "records nothing" in "".join(o.text for o in refused if o.output_type == "stream")


@pytest.mark.skipif(browser_found() is None, reason="needs a browser: chromium or google-chrome on the PATH")
@pytest.mark.slow
def test_what_the_cells_hold_can_be_turned_and_pressed_in_a_browser(executed, tmp_path: Path):
    def write(number: int) -> Path:
        (cell := tmp_path / f"cell{number}.html").write_text(
            "<!doctype html><body>"
            + next(o.data["text/html"] for o in executed.cells[number].outputs if "data" in o)
        )
        return cell

    with a_tab(tmp_path / "profile") as tab:
        tab.open(write(2))
        inside = "document.querySelector('iframe').contentDocument"
        tab.wait(f"{inside}.querySelector('section.view3d')?.dataset.state === 'live'")
        before = tab.evaluate(f"{inside}.querySelector('.stage').dataset.azimuth")
        box = tab.evaluate("document.querySelector('iframe').getBoundingClientRect().left")
        tab.drag(box + 200, 300, -120, 0)
        tab.wait(f"{inside}.querySelector('.stage').dataset.azimuth !== '{before}'")
        tab.open(write(4))
        tab.wait(f"Boolean({inside}.defaultView.palpate?.press)")
        assert tab.complaints == []
