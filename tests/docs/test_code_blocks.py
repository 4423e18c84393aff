"""What the pages show can be typed: commands and flags exist, Python calls fit, marked blocks run."""

from __future__ import annotations

import ast
import inspect
import os
import re
import shlex
import subprocess
import sys
import tomllib
from functools import cache
from pathlib import Path

import pytest

import palpate as pp

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "docs"))
import _reference  # noqa: E402

PAGES = [REPOSITORY / "README.md"] + [
    page
    for page in sorted((REPOSITORY / "docs").rglob("*.md"))
    if not {"generated", "rooms", "decisions"} & set(page.parts)
]
LISTED = [pytest.param(page, id=str(page.relative_to(REPOSITORY))) for page in PAGES]
MADE_UP = {"mesh_size"}
"""The example of an option that does not exist."""
OTHERS = {"--nworkers", "--nthreads", "--port", "--dist", "--loadfile", "--help-all"}
"""Flags of Dask and pytest."""


def blocks(page: Path, language: str) -> list[str]:
    """The code blocks of a page in that language."""
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


@cache
def flags() -> dict[str, set[str]]:
    """command: every spelling of its flags."""
    return {
        name: {word for action in parser._actions for word in action.option_strings}
        for name, (_, parser) in _reference.commands().items()
    }


def shown_commands(page: Path) -> list[list[str]]:
    """Every `palpate ...` of a page, in blocks and in the text, as words."""
    text = page.read_text(encoding="utf-8")
    lines = [line for block in blocks(page, "sh") for line in block.splitlines()]
    lines += re.findall(r"`(palpate [^`\n]+)`", text)
    found = []
    for line in lines:
        for part in re.split(r"&&|;|\|", line.partition("  #")[0]):
            if (at := part.find("palpate ")) >= 0 and re.fullmatch(r"[\s$(\"]*(\.venv/bin/)?", part[:at]):
                found.append(shlex.split(part[at:].replace("…", "").rstrip('")'), posix=False)[1:])
    return [words for words in found if words]


@pytest.mark.parametrize("page", LISTED)
def test_commands_and_their_flags_exist(page):
    for command, *rest in shown_commands(page):
        if command.startswith("-") or command == "COMMAND":
            continue
        assert command in flags(), f"palpate {command}"
        if command == "bench":
            name = next((word for word in rest if word[0].islower()), "")
            assert not name or (REPOSITORY / "benchmarks" / f"{name.replace('-', '_')}.py").is_file(), name
            continue
        words = {word.partition("=")[0] for word in rest if re.match(r"--?[a-z]", word)}
        assert words <= flags()[command] | OTHERS, f"palpate {command} {' '.join(rest)}"


@pytest.mark.parametrize("page", LISTED)
def test_flags_in_the_text_are_some_commands(page):
    every = set().union(*flags().values()) | OTHERS
    text = "".join(page.read_text(encoding="utf-8").split("```")[::2])
    said = {
        word
        for span in re.findall(r"`(--[a-z][^`\n]*)`", text)
        for word in re.findall(r"--[a-z][a-z-]+", span)
    }
    assert said <= every


@pytest.mark.parametrize("page", LISTED)
def test_python_parses_and_calls_what_is_there(page):
    code = "\n".join(blocks(page, "python"))
    for call in (n for n in ast.walk(ast.parse(code)) if isinstance(n, ast.Call)):
        name = ast.unparse(call.func)
        if re.fullmatch(r"pp\.\w+", name):
            function = getattr(pp, name.removeprefix("pp."))
            parameters = inspect.signature(function).parameters
            allowed = set(parameters)
            allowed |= {option.name for option in _reference.options().get(function.__name__, ())}
            assert {k.arg for k in call.keywords} - allowed <= MADE_UP, ast.unparse(call)


@pytest.mark.parametrize("page", LISTED)
def test_toml_parses(page):
    for block in blocks(page, "toml"):
        tomllib.loads(block)


MARKED = [
    pytest.param(code, id=name)
    for page in PAGES
    for name, code in re.findall(
        r"<!-- run: ([\w-]+) -->\n\n?```python\n(.*?)^```", page.read_text("utf-8"), re.DOTALL | re.MULTILINE
    )
]


@pytest.mark.release
@pytest.mark.parametrize("code", MARKED)
def test_marked_blocks_run(code, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-P", str(script)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        env=dict(os.environ, MPLBACKEND="Agg"),
    )
    assert done.returncode == 0, done.stderr
