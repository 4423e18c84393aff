"""The tutorials as notebooks, made from their pages: `write(folder)` while the site is built, or
`python docs/_notebooks.py FOLDER`.

A command of a shell becomes the Python call that does the same, by the one declaration of both; what has no
call stands as `!palpate ...`. Where a notebook does something else, the page says so before its block:

    <!-- notebook: palpate touch silicone-2 --headless --record session.csv.gz -->

Pictures are inside. Other pages are named, not linked: a notebook lies anywhere.
"""

from __future__ import annotations

import base64
import json
import re
import shlex
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from palpate.operations._list import OPERATIONS
from palpate.operations._run import command_operation, parser_of
from tools.tutorials import BLOCK, PAGES, commands

NAMES = ("first-touch", "two-minutes", "first-diagnosis")
AFTERWARDS = {
    "report": ".report({})",
    "corrected": ".corrected().save({})",
    "apply": ".improved().save({})",
}
"""What a command writes by an option, and Python by a method of the result."""


def notebook(page: Path) -> dict[str, Any]:
    """A page as a notebook (nbformat 4.5)."""
    text, at = page.read_text(encoding="utf-8"), 0
    cells: list[dict[str, Any]] = []
    for block in BLOCK.finditer(text):
        if block["kind"] not in ("sh", "python"):
            continue
        cells += _words(text[at : block.start()], page.parent)
        cells += map(_code, _cells_of(block))
        at = block.end()
    cells += _words(text[at:], page.parent)
    cells.insert(1, _code("import palpate as pp"))
    for number, cell in enumerate(cells):
        cell["id"] = f"{page.stem}-{number}"
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    return {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}


def _cells_of(block: re.Match[str]) -> list[str]:
    """The code of a block's cells: one a command, or the block as it is."""
    if block["kind"] == "python":
        return [block["code"].rstrip()]
    if block["instead"]:
        return [f"# in a notebook a simulated hand does it\n{call(block['instead'])}"]
    return [call(line) for line in commands(block)]


def call(line: str) -> str:
    """The Python of a command; `!` and the command where it has none."""
    program, *words = shlex.split(line)
    if program != "palpate" or not OPERATIONS[words[0]].calls:
        return f"!{line}"
    operation, _ = command_operation(words[0])
    given = vars(parser_of(words[0]).parse_args(words[1:]))
    said = {
        name: value
        for name, value in given.items()
        if name in operation.fields and value != operation.fields[name].default
    }
    then = [AFTERWARDS[name].format(_written(said.pop(name))) for name in AFTERWARDS if name in said]
    first = next(iter(operation.own))
    arguments = [_written(said.pop(first))] if first in said else []
    arguments += [f"{name}={_written(value)}" for name, value in said.items()]
    python = f"pp.{OPERATIONS[words[0]].calls.split()[0]}({', '.join(arguments)})"
    if then:
        python = "\n".join([f"found = {python}", *(f"found{each}" for each in then), "found"])
    page = ["# in a notebook this is a page to press, not a window"] if python.startswith("pp.touch(") else []
    return "\n".join([f"# {line}", *(page if "headless" not in said else []), python])


def _written(value: Any) -> str:
    """A value as Python has it; NAME=NUMBER of a command is a dictionary's."""
    if isinstance(value, list) and value and all(isinstance(each, str) and "=" in each for each in value):
        value = {name: float(number) for name, _, number in (each.partition("=") for each in value)}
    said = repr(value)
    return said if '"' in said else said.replace("'", '"')


def _code(text: str) -> dict[str, Any]:
    return {
        "cell_type": "code", "execution_count": None, "metadata": {}, "outputs": [], "source": text
    }  # fmt: skip


def _words(text: str, folder: Path) -> list[dict[str, Any]]:
    """Words as a cell, none for none; pictures beside."""
    text = re.sub(r"<!--.*?-->\n?", "", text, flags=re.DOTALL).strip()
    attachments: dict[str, dict[str, str]] = {}

    def inside(found: re.Match[str]) -> str:
        picture = folder / found[2]
        attachments[picture.name] = {"image/png": base64.b64encode(picture.read_bytes()).decode()}
        return f"![{found[1]}](attachment:{picture.name})"

    text = re.sub(r"!\[([^\]]*)\]\(([^)]+\.png)\)", inside, text)
    text = re.sub(r"(?<!!)\[([^\]]+)\]\((?!https?:|attachment:)[^)]+\)", r"*\1*", text)
    more = {"attachments": attachments} if attachments else {}
    return [{"cell_type": "markdown", "metadata": {}, "source": text, **more}] if text else []


def write(folder: Path) -> None:
    """A notebook a tutorial."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in NAMES:
        made = json.dumps(notebook(PAGES / f"{name}.md"), indent=1, ensure_ascii=False) + "\n"
        (folder / f"{name}.ipynb").write_text(made, encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
