"""The tutorials as notebooks: made from the pages, valid, and run by a kernel as they stand."""

from __future__ import annotations

import ast
import re
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import palpate as pp

from ..shell.show.frames import page_in
from .test_blocks_run import DOCS, code_of, lines_of

sys.path.insert(0, str(DOCS))
import _notebooks

SAYS = {
    "first-touch": (r"Young's modulus (1[4-8])",),
    "two-minutes": (r"tool", r"surface"),
    "first-diagnosis": (r"force reads late by 2[45]", r"The simulation leaves out time delay"),
}
"""What the cells' results say."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("notebooks")
    _notebooks.write(folder)
    return {path.stem: nbformat.read(path, as_version=4) for path in folder.glob("*.ipynb")}


@pytest.mark.parametrize("name", _notebooks.NAMES)
def test_a_notebook_holds_each_command_and_block_of_its_page_as_calls_that_are_there(name, made):
    page, cells = DOCS / "tutorials" / f"{name}.md", made[name].cells
    nbformat.validate(made[name])
    code = [cell.source for cell in cells if cell.cell_type == "code"]
    said = [text for text in code if text.startswith("#")]
    assert len(said) == len(lines_of(page)) and all(block.rstrip() in code for block in code_of(page))
    for text in said:
        calls = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]
        names = {node.func.attr for node in calls if getattr(node.func.value, "id", "") == "pp"}
        assert len(names) == 1 and hasattr(pp, names.pop()), text
    words = "".join(cell.source for cell in cells if cell.cell_type == "markdown")
    assert "<!--" not in words and not re.findall(r"\]\((?!attachment:)", words), (
        "a picture or link that is elsewhere"
    )


def test_a_command_without_a_call_is_a_shells_and_strengths_are_numbers():
    assert _notebooks.call("palpate demo") == "!palpate demo"
    python = _notebooks.call("palpate simulate block -o b.csv.gz --effect adhesion=0.5").splitlines()[1]
    assert python == 'pp.simulate("block", save="b.csv.gz", effects={"adhesion": 0.5})'


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("first-diagnosis", marks=pytest.mark.slow),
        pytest.param("first-touch", marks=pytest.mark.release),
        pytest.param("two-minutes", marks=pytest.mark.release),
    ],
)
def test_a_notebook_runs_and_its_results_show_the_view_of_their_pages(name, made, tmp_path: Path):
    client = NotebookClient(made[name], timeout=3600, resources={"metadata": {"path": str(tmp_path)}})
    cells = [cell for cell in client.execute().cells if cell.cell_type == "code"]
    shown = [out.data for cell in cells for out in cell.outputs if "data" in out]
    words = "\n".join(data.get("text/plain", "") for data in shown)
    assert all(re.search(each, words) for each in SAYS[name]), words
    frames = [data["text/html"] for data in shown if "<iframe" in data.get("text/html", "")]
    assert len(frames) >= 2 and all("<script" in page_in(each) for each in frames)
    asked = [cell for cell in cells if re.match(r"#.*\n#.*page to press.*\npp\.touch", cell.source)]
    assert all(
        any("window.palpate" in page_in(o.data["text/html"]) for o in c.outputs if "data" in o) for c in asked
    )
