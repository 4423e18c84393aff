"""Evidence pages and marked numbers, from docs/evidence/NAME.json as benchmarks write them.

`write(folder)` makes a page of every file while the site is built. `python docs/_evidence.py README.md` puts
the files' numbers between the markers of a page:

    <!-- evidence: NAME what -->28.9<!-- end -->

`what` is a figure's own; the number keeps the decimals with which it is written. Where `what` is "processor",
"date" or "commit" it is that word of the file. A test runs `filled` over README and all pages and fails where
one differs or its file or figure is missing.
"""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
EVIDENCE = ROOT / "docs" / "evidence"
KEYS = {"command", "commit", "date", "processor", "figures"}
FIGURE_KEYS = {"what", "value", "spread", "unit", "target", "met"}
WORDS = ("processor", "date", "commit")
MARKED = re.compile(r"(<!-- evidence: (\S+) (.+?) -->)(.*?)(<!-- end -->)", re.DOTALL)


class EvidenceError(ValueError):
    """A file or a marker that does not hold what it should; says which, and what to do."""


@dataclass(frozen=True)
class Evidence:
    """One benchmark's file. figures: mappings with FIGURE_KEYS; spread, target and met may be None."""

    name: str
    command: str
    commit: str
    date: str
    processor: str
    figures: tuple[dict[str, Any], ...]

    def value(self, what: str) -> float:
        """The figure of that name; raises EvidenceError where there is none."""
        for figure in self.figures:
            if figure["what"] == what:
                return figure["value"]
        have = ", ".join(figure["what"] for figure in self.figures)
        raise EvidenceError(f"docs/evidence/{self.name}.json has no figure '{what}'; it has {have}")


def read(path: Path) -> Evidence:
    """One file; raises EvidenceError where a key is missing."""
    held = json.loads(path.read_text(encoding="utf-8"))
    if missing := KEYS - set(held):
        raise EvidenceError(f"{path.name} lacks {', '.join(sorted(missing))}: run its benchmark again")
    for figure in held["figures"]:
        if missing := {"what", "value", "unit"} - set(figure):
            raise EvidenceError(f"a figure of {path.name} lacks {', '.join(sorted(missing))}")
    figures = tuple({key: figure.get(key) for key in FIGURE_KEYS} for figure in held["figures"])
    return Evidence(path.stem, *(held[key] for key in ("command", "commit", "date", "processor")), figures)


def all_evidence(folder: Path = EVIDENCE) -> list[Evidence]:
    """Every file of the folder, by name."""
    return [read(path) for path in sorted(folder.glob("*.json"))]


def filled(text: str, folder: Path = EVIDENCE) -> str:
    """A page with the files' numbers between its markers; raises EvidenceError where one has no source."""

    def number(found: re.Match[str]) -> str:
        begin, name, what, stood, end = found.groups()
        path = folder / f"{name}.json"
        if not path.is_file():
            raise EvidenceError(
                f"'{stood}' is marked as '{what}' of {name}, but docs/evidence/{name}.json is missing"
            )
        if what in WORDS:
            return f"{begin}{getattr(read(path), what)}{end}"
        decimals = len(stood.strip().partition(".")[2])
        return f"{begin}{read(path).value(what):,.{decimals}f}{end}"

    return MARKED.sub(number, text)


def page(evidence: Evidence) -> str:
    """A table of all figures, missed targets beside met ones."""
    lines = [f"# {evidence.name.replace('_', ' ').replace('-', ' ').capitalize()}", ""]
    if words := about(evidence.name):
        lines += [_cell(words), ""]
    met = [figure["met"] for figure in evidence.figures if figure["target"]]
    if met:
        lines += [f"{sum(map(bool, met))} of {len(met)} targets met.", ""]
    lines += ["| what | value | spread | unit | target | |", "| --- | --- | --- | --- | --- | --- |"]
    for figure in evidence.figures:
        spread = figure["spread"]
        said = "" if not spread or spread[0] == spread[1] else f"{spread[0]:.4g} to {spread[1]:.4g}"
        unit = "" if figure["unit"] == "1" else figure["unit"]
        verdict = "" if not figure["target"] else "met" if figure["met"] else "**missed**"
        target = _cell(str(figure["target"] or ""))
        lines.append(
            f"| {_cell(figure['what'])} | {figure['value']:.4g} | {said} | {unit} | {target} | {verdict} |"
        )
    lines += [
        "",
        f"`{evidence.command}`, commit {evidence.commit[:10]}, {evidence.date}, {evidence.processor}.",
        "",
    ]
    if words := age(evidence):
        lines += [words, ""]
    return "\n".join(lines)


def about(name: str, root: Path = ROOT) -> str:
    """What a benchmark measures, as the first paragraph of its own docstring says; '' where it is gone."""
    path = root / "benchmarks" / f"{name.replace('-', '_')}.py"
    if not path.is_file():
        return ""
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return " ".join(said.partition("\n\n")[0].split())


def _cell(words: str) -> str:
    """Words as they stand, in a table; code is code."""
    parts = re.split(r"(`[^`]*`)", words)
    return "".join(p if k % 2 else re.sub(r"([*<|]|-(?=-))", r"\\\1", p) for k, p in enumerate(parts))


def age(evidence: Evidence, root: Path = ROOT) -> str:
    """What a page says of figures whose code has changed since, in any version, or that are of a
    state which this history does not have; '' for others. root: of the clone."""
    if not _git(root, "rev-parse", "--git-dir"):
        return ""  # not a clone: nothing is known of what came when
    then, now = _version(root, evidence.commit.removesuffix("-dirty")), _version(root, "HEAD")
    if not then:
        return "**These figures are of a state that this history does not have.** Run the command again."
    changed = changes(evidence, root)
    if not changed:
        return ""
    commits = "1 commit has" if changed == 1 else f"{changed} commits have"
    folders = ", ".join(f"`{folder}`" for folder in _measured(root, evidence.name))
    version = f"version {now}" if then == now else f"version {then} then, {now} now"
    return (
        f"**Since then {commits} changed what it measures** (folders {folders}; {version}). "
        "The figures are of the commit above: the command says what they are now."
    )


def changes(evidence: Evidence, root: Path = ROOT) -> int | None:
    """How many commits since changed the folders that a benchmark imports; None where that cannot be told."""
    commit = evidence.commit.removesuffix("-dirty")
    asked = ("rev-list", "--count", f"{commit}..HEAD", "--", *_measured(root, evidence.name))
    return int(said) if (said := _git(root, *asked).strip()) else None


def _git(root: Path, *words: str) -> str:
    """What git says; '' where it fails."""
    said = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True)
    return "" if said.returncode else said.stdout


def _version(root: Path, commit: str) -> str:
    """The program's version at a commit; '' where that cannot be told."""
    text = _git(root, "show", f"{commit}:pyproject.toml")
    return str(tomllib.loads(text)["project"]["version"]) if text else ""


def _measured(root: Path, name: str) -> list[str]:
    """The rooms that a benchmark imports, itself and by its helpers; all where it is gone."""
    text = (root / "pyproject.toml").read_text(encoding="utf-8")
    rooms = {package: folder for folder, package in tomllib.loads(text)["tool"]["palpate"]["rooms"].items()}
    seen: set[str] = set()
    waiting = [f"benchmarks.{name.replace('-', '_')}"]
    packages: set[str] = set()
    while waiting:
        module = waiting.pop()
        path = root / (module.replace(".", "/") + ".py")
        if module in seen or not path.is_file():
            continue
        seen.add(module)
        for found in re.findall(
            r"^\s*(?:from|import) ([\w.]+)", path.read_text(encoding="utf-8"), re.MULTILINE
        ):
            if found.startswith("benchmarks."):
                waiting.append(found)
            elif found.partition(".")[0] == "palpate":
                packages.add(rooms.get(".".join(found.split(".")[:2]), rooms["palpate"]))
    return sorted(packages) or ["."]


_NUMBER = re.compile(
    r"(?<![\w./,-])\d[\d,]*(?:\.\d+)?(?:\s?(?:to|of|±)\s\d[\d,.]*)?\s?(?:%|times\b|(?:[munkM]?(?:N|Pa|s|m|Hz|J|W)|[µu]s|kg|g|"
    r"min|MB|GB|ticks|cases|presses|lines|points)(?:/\w+)?(?![\w]))"
)
_SETTING = re.compile(r"<!-- setting -->.*?<!-- end -->", re.DOTALL)


def unmarked(text: str) -> list[str]:
    """Numbers with a unit in a page of evidence that stand neither between evidence markers nor between
    `<!-- setting -->` and `<!-- end -->` (what was asked of a benchmark, not measured), nor in code."""
    parts = "".join(text.split("```")[::2])
    plain = re.sub(r"`[^`]*`", "", _SETTING.sub("", MARKED.sub("", parts)))
    return [found[0] for found in _NUMBER.finditer(plain)]


def write(folder: Path, source: Path = EVIDENCE) -> None:
    """A page a file, and `index.md` with a line each."""
    folder.mkdir(parents=True, exist_ok=True)
    have = all_evidence(source)
    rows, names = [], []
    for evidence in have:
        _keep(folder / f"{evidence.name}.md", page(evidence))
        aimed = [figure for figure in evidence.figures if figure["target"]]
        missed = [_cell(figure["what"]) for figure in aimed if not figure["met"]]
        since = changes(evidence)
        rows.append(
            f"| [{evidence.name}]({evidence.name}.md) | {evidence.date}, {evidence.commit[:7]} | "
            f"{'?' if since is None else since} | {len(evidence.figures)} | "
            f"{', '.join(missed) or ('none' if aimed else 'no target')} |"
        )
        names.append(evidence.name)
    lines = ["# Figures", ""]
    if have:
        lines += [
            "| benchmark | measured | commits since that changed its code | figures | targets missed |",
            "| --- | --- | --- | --- | --- |",
            *rows,
            "",
        ]
        lines += ["```{toctree}", ":hidden:", "", *names, "```", ""]
    else:
        lines += ["No benchmark has written its file for this version yet, so nothing is claimed here.", ""]
    _keep(folder / "index.md", "\n".join(lines))
    for page_ in folder.glob("*.md"):
        if page_.stem not in {"index", *names}:
            page_.unlink()


def _keep(path: Path, text: str) -> None:
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:]:
        marked = Path(name)
        marked.write_text(filled(marked.read_text(encoding="utf-8")), encoding="utf-8")
