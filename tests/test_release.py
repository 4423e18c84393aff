"""A release: the same bytes whenever it is packed, and one version everywhere."""

from __future__ import annotations

import io
import re
import tarfile
import tomllib

from tools.same_bytes import repacked

from .conftest import REPOSITORY


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


def test_one_version_is_stated_everywhere():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
    citation = (REPOSITORY / "CITATION.cff").read_text("utf-8")
    recipe = (REPOSITORY / "packaging" / "conda-forge" / "recipe.yaml").read_text("utf-8")
    assert re.search(r"^version: (.+)$", citation, re.MULTILINE)[1] == project["version"]
    assert re.search(r'^  version: "(.+)"$', recipe, re.MULTILINE)[1] == project["version"]
    assert f"## {project['version']} (unreleased)" in (REPOSITORY / "CHANGELOG.md").read_text("utf-8")


def test_the_recipe_asks_for_what_the_package_asks_for():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
    recipe = (REPOSITORY / "packaging" / "conda-forge" / "recipe.yaml").read_text("utf-8")
    run = recipe.partition("  run:\n")[2].partition("\ntests:")[0]
    asked = set(re.findall(r"^    - ([\w-]+)", run, re.MULTILINE))
    names = {"matplotlib": "matplotlib-base"}
    everywhere = [line for line in project["dependencies"] if ";" not in line]
    wanted = {re.match(r"[\w-]+", line)[0] for line in everywhere}
    assert {names.get(name, name) for name in wanted} <= asked
