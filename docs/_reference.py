"""The generated reference: commands, options, effects and JSON Schemas as the program states them.

`write(folder)` runs while the site is built; the pages are never committed.
"""

from __future__ import annotations

import argparse
import contextlib
import inspect
import json
import os
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


def commands() -> dict[str, tuple[str, argparse.ArgumentParser]]:
    """name: (one line, parser). The one place that knows where parsers come from."""
    from palpate.operations._list import commands as summaries
    from palpate.operations._run import parser_of

    return {name: (words, parser_of(name)) for name, words in summaries().items()}


def options() -> dict[str, Sequence[Any]]:
    """Function of `import palpate as pp`: its options, as `pp.options` gives them."""
    import palpate as pp

    found = {}
    for name in dir(pp):
        if inspect.isfunction(getattr(pp, name)):
            with contextlib.suppress(pp.PalpateError):
                found[name] = pp.options(name)
    return found


def command_page(name: str, words: str, parser: argparse.ArgumentParser) -> str:
    """Purpose, arguments and options of one command, in the groups of its help."""
    os.environ["COLUMNS"] = "84"  # argparse asks it for the width
    text = parser.format_all_help() if hasattr(parser, "format_all_help") else parser.format_help()
    usage, _, rest = text.partition("\n\n")
    description, _, groups = rest.partition("\npositional arguments:\n")
    if not groups:
        description, _, groups = rest.partition("\noptions:\n")
        groups = "options:\n" + groups
    else:
        groups = "positional arguments:\n" + groups
    lines = [f"# palpate {name}", "", _plain(description.strip() or words), ""]
    for title, body in re.findall(r"^(\S.*):\n((?:[ \t].*\n?|\n)*)", groups, re.MULTILINE):
        lines += [f"## {title[:1].upper() + title[1:]}", "", "```text", body.rstrip(), "```", ""]
    lines += ["## Usage", "", "```text", usage, "```", ""]
    return "\n".join(lines)


def _plain(words: str) -> str:
    """A description as it stands: set-in lines are code, stars and angle brackets are themselves."""
    out: list[str] = []
    for paragraph in words.split("\n\n"):
        if paragraph.startswith("    "):
            out.append("```sh\n" + "\n".join(line[4:] for line in paragraph.splitlines()) + "\n```")
        else:
            marked = re.sub(r"(?<![\w`-])(--[a-z][a-z-]*)", r"`\1`", paragraph)
            out.append(_cell(re.sub(r"'(palpate [^']+)'", r"`\1`", marked)))
    return "\n\n".join(out)


def options_page() -> str:
    """Every keyword of the Python functions, with unit, default and range."""
    lines = [
        "# Options of the Python functions",
        "",
        "A command's flag is the same name with dashes, less its unit.",
        "",
    ]
    for function, given in options().items():
        if not given:
            continue
        lines += [
            f"## pp.{function}",
            "",
            "| option | default | unit | meaning |",
            "| --- | --- | --- | --- |",
        ]
        for each in given:
            allowed = f"; one of {', '.join(each.choices)}" if each.choices else ""
            default = "" if each.default in (None, "") else f"`{each.default}`"
            lines.append(f"| `{each.name}` | {default} | {each.unit} | {_cell(each.help + allowed)} |")
        lines.append("")
    return "\n".join(lines)


def effects_page() -> str:
    """Every effect with its keys, their units and ranges, and what can be done with it."""
    from palpate.mechanics.effects.registry import effects

    lines = [
        "# Effects: names and keys",
        "",
        "The same keys stand in `[effects.NAME]` of a model, in `diagnose --json` and in a recording's",
        "`[truth.parameters.NAME]`. Pictures and words: [every effect](../../reading/effects.md).",
        "",
    ]
    for each in effects():
        can = ["goes into a model (`--apply`)" if each.rendered else "is not rendered"]
        can += ["can be taken off a recording (`--corrected`)"] if each.correct else []
        lines += [f"## {each.name}", "", f"{_cell((each.plain_words or each.words).capitalize())}.", ""]
        lines += [f"Domain {each.domain}; shows {each.scope.value}; {', '.join(can)}.", ""]
        keys = {name: key for name, key in (each.keys or {}).items() if hasattr(key, "words")}
        if keys:
            lines += ["| key | unit | allowed |", "| --- | --- | --- |"]
            lines += [f"| `{name}` | {key.unit or ''} | {key.words} |" for name, key in keys.items()]
            lines.append("")
    return "\n".join(lines)


def schema_files() -> dict[str, str]:
    """Name of a file: its JSON Schema."""
    from palpate.schemas import names, schema

    return {f"{name}.schema.json": json.dumps(schema(name), indent=1) + "\n" for name in names()}


def schemas_page() -> str:
    """Every schema, folded."""
    lines = [
        "# JSON Schemas",
        "",
        "Of what each command writes with `--json`, and of each TOML that it reads or writes (draft",
        "2020-12). The key `schema` of a `--json` is the `$id` of its schema, whose last part is the",
        "version: keys may join one; a key that is renamed or means something else makes the next. In Python",
        '`palpate.schemas.schema("diagnose")`.',
        "",
    ]
    for file, text in schema_files().items():
        url = f"../../schemas/{file}"
        lines += [f"## {file.removesuffix('.schema.json')}", "", f"<a href='{url}'>{file}</a>", ""]
        lines += [
            "<details><summary>show</summary>",
            "",
            "```json",
            text.rstrip(),
            "```",
            "",
            "</details>",
            "",
        ]
    return "\n".join(lines)


def _cell(words: str) -> str:
    return re.sub(r"([*<|])", r"\\\1", words)


def pages() -> dict[str, str]:
    """path below the folder: Markdown; below `files/`, what the site carries as it is."""
    made = {f"commands/{name}.md": command_page(name, *about) for name, about in commands().items()}
    listed = [
        f"| [`palpate {name}`](commands/{name}.md) | {words} |" for name, (words, _) in commands().items()
    ]
    names = "\n".join(f"commands/{name}" for name in commands())
    made["commands.md"] = "\n".join(
        ["# Commands", "", "| command | does |", "| --- | --- |", *listed, "",
         "Exit codes: 0 done, 1 the answer is bad, 2 bad arguments or input. Every command has `--help`",
         "(`--help-all` for every option) and, where it has a result, `--json PATH`.",
         "A misspelt name is answered with the one that was probably meant.", "",
         "```{toctree}", ":hidden:", "", names, "```", ""]
    )  # fmt: skip
    made["options.md"] = options_page()
    made["effects.md"] = effects_page()
    made["schemas.md"] = schemas_page()
    made |= {f"files/schemas/{name}": text for name, text in schema_files().items()}
    return made


def write(folder: Path) -> None:
    """Write all pages; one that has not changed keeps its time, so that the site is not built anew."""
    for name, text in pages().items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    write(Path(__file__).resolve().parent / "reference" / "generated")
