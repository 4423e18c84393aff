"""A real notebook, executed without a screen: objects show themselves, `.show()` turns in the cell."""

from __future__ import annotations

import html
import re
from pathlib import Path

import pytest

from .browser import a_tab, browser_found

nbclient = pytest.importorskip("nbclient", reason="needs nbclient and ipykernel, which execute notebooks")
pytest.importorskip("ipykernel", reason="needs nbclient and ipykernel, which execute notebooks")

CELLS = (
    "import numpy as np\n"
    "import palpate as pp\n"
    "from palpate.mechanics.shape.tetmesh import box_mesh\n"
    "from palpate.mechanics.model.material import Material\n"
    "from palpate.mechanics.model.model import Model, Support, Tool\n"
    "support = Support(np.zeros(3), np.array([0.0, 0.0, 1.0]))\n"
    "mesh = box_mesh((4, 4, 2), (0.06, 0.06, 0.03)).quadratic()\n"
    "pp.Model\n"
    "model = Model(mesh, Material(20e3, 0.49), support, Tool(0.005), mesh_size_m=0.015)",
    "model",
    "model.show()",
)


@pytest.fixture(scope="module")
def executed():
    from nbformat import v4

    notebook = v4.new_notebook(cells=[v4.new_code_cell(text) for text in CELLS])
    notebook.metadata.kernelspec = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return nbclient.NotebookClient(notebook, timeout=300).execute()


@pytest.mark.slow
def test_a_result_shows_itself_and_its_show_is_the_view_of_the_pages(executed, tmp_path: Path):
    _, itself, shown = (cell.outputs for cell in executed.cells)
    own = next(output.data["text/html"] for output in itself if output.output_type == "execute_result")
    assert "20.00 kPa" in own and "data:image/png;base64" in own
    assert [output.output_type for output in shown] == ["display_data"], "no warning, no None, no bitmap"
    page = re.search('srcdoc="(.*?)" title', shown[0].data["text/html"], re.DOTALL)[1]
    assert "view3d" in html.unescape(page)


@pytest.mark.skipif(browser_found() is None, reason="needs a browser: chromium or google-chrome on the PATH")
@pytest.mark.slow
def test_what_the_cell_holds_can_be_turned_in_a_browser(executed, tmp_path: Path):
    cell = tmp_path / "cell.html"
    cell.write_text(f"<!doctype html><body>{executed.cells[2].outputs[0].data['text/html']}")
    with a_tab(tmp_path / "profile") as tab:
        tab.open(cell)
        inside = "document.querySelector('iframe').contentDocument"
        tab.wait(f"{inside}.querySelector('section.view3d')?.dataset.state === 'live'")
        before = tab.evaluate(f"{inside}.querySelector('.stage').dataset.azimuth")
        box = tab.evaluate("document.querySelector('iframe').getBoundingClientRect().left")
        tab.drag(box + 200, 300, -120, 0)
        tab.wait(f"{inside}.querySelector('.stage').dataset.azimuth !== '{before}'")
        assert tab.complaints == []
