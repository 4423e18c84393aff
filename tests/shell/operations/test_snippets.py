"""The Python of README and docs/howto/python.md runs as it stands, from an empty folder."""

from __future__ import annotations

import ast
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import palpate as pp

REPOSITORY = Path(__file__).resolve().parents[3]


def snippets(page: str) -> str:
    """Every python block of a page, one after another."""
    text = (REPOSITORY / page).read_text(encoding="utf-8")
    return "\n".join(re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE))


def run(page: str, folder: Path) -> str:
    script = folder / "script.py"
    script.write_text(snippets(page), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-P", str(script)],
        cwd=folder,
        capture_output=True,
        text=True,
        env=dict(os.environ, MPLBACKEND="Agg"),
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("page", ["README.md", "docs/howto/python.md"])
def test_what_the_pages_call_is_there(page):
    calls = [n for n in ast.walk(ast.parse(snippets(page))) if isinstance(n, ast.Call)]
    named = [(ast.unparse(call.func), call) for call in calls]
    ours = [(name.removeprefix("pp."), call) for name, call in named if re.fullmatch(r"pp\.\w+", name)]
    assert len(ours) >= 5
    for name, call in ours:
        allowed = set(inspect.signature(getattr(pp, name)).parameters)
        wrong = {k.arg for k in call.keywords} - allowed
        assert wrong <= {"mesh_size"}  # the page's example of an error


def test_readme_shows_six_lines():
    assert len([line for line in snippets("README.md").splitlines() if line]) == 6


@pytest.mark.slow
def test_readme_runs(tmp_path):
    said = run("README.md", tmp_path)
    assert re.search(r"Young's modulus 2[789]\.\d+ kPa", said)
    assert "finite strain" in said
    assert float(re.search(r"differ by (\S+) mN", said)[1]) < 50
    assert (tmp_path / "my-model" / "mesh.vtu").is_file() and (tmp_path / "press.png").stat().st_size > 10_000


@pytest.mark.release
def test_page_runs(tmp_path):
    said = run("docs/howto/python.md", tmp_path)
    assert "did you mean mesh_size_m" in said and "{'tool_compliance': 1.0}" in said
    written = "touches.png object.png forces.csv press.png gap.html better-model block.csv.gz"
    assert set(written.split()) <= {p.name for p in tmp_path.iterdir()}
    assert str(pp.load(tmp_path / "better-model")).startswith("Model of silicone-1-cylinder")
