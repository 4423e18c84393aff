"""A release: the same bytes whenever it is packed, and one version everywhere."""

from __future__ import annotations

import io
import re
import subprocess
import tarfile
import tomllib
from importlib import metadata

import pytest

import palpate
from tools import tutorials
from tools.same_bytes import repacked

from .conftest import REPOSITORY
from .docs.test_blocks_run import lines_of


def _archive(names: list[str], seconds: int, owner: str) -> bytes:
    out = io.BytesIO()
    with tarfile.open(fileobj=out, mode="w:gz") as tar:
        for name in names:
            about = tarfile.TarInfo(name)
            about.size, about.mtime, about.uname, about.mode = len(name), seconds, owner, 0o664
            tar.addfile(about, io.BytesIO(name.encode()))
    return out.getvalue()


def test_an_sdist_depends_on_its_files_alone():
    first = _archive(["p/b.py", "p/a.py"], 1_700_000_000, "ann")
    second = _archive(["p/a.py", "p/b.py"], 1_800_000_000, "ben")
    assert first != second
    packed = repacked(first, 1_750_000_000)
    assert packed == repacked(second, 1_750_000_000)
    with tarfile.open(fileobj=io.BytesIO(packed)) as tar:
        found = {m.name: tar.extractfile(m).read().decode() for m in tar.getmembers()}
        assert {m.mtime for m in tar.getmembers()} == {1_750_000_000}
    assert found == {"p/a.py": "p/a.py", "p/b.py": "p/b.py"}


PROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
SAID = re.compile(
    r"""^version:\ (\S+)$ | ^\ \ version:\ "(\S+)"$ | ^\#\#\ (\S+)\ \(unreleased\)$
    | \bpalpate(?:\ v?|-|==|\ *>=\ *)(\d+\.\d+[\w.]*)""",
    re.MULTILINE | re.VERBOSE,
)
"""How a citation, a recipe, the changelog, a form or a page says which version this is."""


def test_one_version_is_stated_everywhere():
    words = [
        "git",
        "-C",
        str(REPOSITORY),
        "ls-files",
        "*.md",
        "*.yml",
        "*.yaml",
        "*.cff",
        "packaging",
        "tools",
    ]
    listed = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
    said = {
        (name, next(filter(None, found.groups())))
        for name in listed
        for found in SAID.finditer((REPOSITORY / name).read_text("utf-8"))
    }
    assert {"CHANGELOG.md", "CITATION.cff", "packaging/conda-forge/recipe.yaml"} <= {name for name, _ in said}
    assert {version for _, version in said} == {PROJECT["version"]}, said


def test_what_is_installed_says_the_version_of_the_clone():
    """Where it does not: `pip install` again, as after a new file."""
    assert palpate.__version__ == metadata.version("palpate") == PROJECT["version"]


def test_the_changelog_is_read_in_five_minutes():
    newest = re.split(r"^## ", (REPOSITORY / "CHANGELOG.md").read_text("utf-8"), flags=re.MULTILINE)[1]
    assert len(newest.split()) <= 5 * 240


def _asked(line: str) -> tuple[str, frozenset[str]]:
    """A requirement's name, as conda-forge has it, and its bounds."""
    name, bounds = re.fullmatch(r"([\w-]+)\s*(.*)", line.partition(";")[0].strip()).groups()
    return {"matplotlib": "matplotlib-base"}.get(name, name), frozenset(
        bounds.replace(" ", "").split(",")
    ) - {""}


def test_the_recipe_asks_for_what_the_package_asks_for():
    recipe = (REPOSITORY / "packaging" / "conda-forge" / "recipe.yaml").read_text("utf-8")
    run = recipe.partition("  run:\n")[2].partition("\ntests:")[0]
    asked = {_asked(line) for line in re.findall(r"^    - (.+)$", run, re.MULTILINE)}
    python = ("python", frozenset({PROJECT["requires-python"]}))
    everywhere = {_asked(line) for line in PROJECT["dependencies"] if ";" not in line}
    assert asked == everywhere | {python}
    built = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["build-system"]["requires"]
    host = recipe.partition("  host:\n")[2].partition("  run:")[0]
    assert {_asked(line) for line in built} <= {
        _asked(line) for line in re.findall(r"^    - (.+)$", host, re.MULTILINE)
    }
    (script,) = PROJECT["scripts"].items()
    assert f"- {script[0]} = {script[1]}" in recipe


@pytest.mark.parametrize("name", tutorials.NAMES)
def test_a_release_runs_each_command_of_a_tutorial(name):
    printed = lines_of(tutorials.PAGES / f"{name}.md")
    ran = [text for kind, text in tutorials.steps(name, screen=True) if kind == "command"]
    left_out = [line for line in printed if line not in ran]
    assert all(tutorials.NOT_HERE.match(line) for line in left_out)
    scripts = [kind for kind, _ in tutorials.steps(name, screen=False) if kind.endswith(".py")]
    assert scripts == (["late.py"] if name == "first-diagnosis" else [])
    touches = [t for _, t in tutorials.steps(name, screen=False) if t.startswith("palpate touch")]
    assert all("--headless" in each for each in touches)


def test_what_a_page_says_is_printed_is_compared_by_words_and_nearly_by_numbers():
    line = "a touch is 145 mN off, 23 mN with it"
    assert tutorials.is_said(line, "first\na touch is 144 mN off, 23 mN with it")
    assert not tutorials.is_said(line, "a touch is 160 mN off, 23 mN with it")
    assert not tutorials.is_said(line, "a press is 145 mN off, 23 mN with it")
