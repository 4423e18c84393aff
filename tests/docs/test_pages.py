"""Pages: links lead somewhere, lines and length are bounded, each effect and command has its place."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from palpate.mechanics.effects.registry import NAMES

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / "docs"))
import _reference  # noqa: E402

DOCS = REPOSITORY / "docs"
PAGES = [
    REPOSITORY / name for name in ("README.md", "CONVENTIONS.md", "CONTRIBUTING.md", "CODE_OF_CONDUCT.md")
] + [
    page for page in sorted(DOCS.rglob("*.md")) if "generated" not in page.parts and "rooms" not in page.parts
]
LINK = re.compile(r"\]\(([^)\s]+)\)")
COUNTED = ("tutorials", "howto", "reading", "explanation", "develop")
MOST_WORDS, MOST_README_WORDS, MOST_COLUMNS, MOST_DECISIONS = 23_300, 900, 120, 40
GROWS = "effects.md"  # by a section an effect: what one adds by the how-to must not fail a count of words
GENERATED = {
    "commands",
    "options",
    "effects",
    "schemas",
    *(f"commands/{name}" for name in _reference.commands()),
}


def _prose(page: Path) -> str:
    """A page without what stands in code blocks."""
    return "".join(page.read_text(encoding="utf-8").split("```")[::2])


def _anchors(page: Path) -> set[str]:
    """What a heading is linked by, as MyST and GitHub make it."""
    heads = re.findall(r"^#{1,4} (.+)$", _prose(page), re.MULTILINE)
    slugs = (re.sub(r"[^\w\- ]", "", head.replace("`", "").lower()) for head in heads)
    return {slug.replace(" ", "-") for slug in slugs}


def _exists(page: Path, target: str) -> bool:
    path, _, anchor = target.partition("#")
    found = (page.parent / path).resolve() if path else page
    if DOCS / "gallery" in found.parents:
        return (REPOSITORY / "examples" / f"{found.name}.py").is_file() or found.name == "index"
    if DOCS / "reference" / "generated" in found.parents:
        return str(found.relative_to(DOCS / "reference" / "generated").with_suffix("")) in GENERATED
    if not found.exists():
        return False
    return not anchor or anchor in _anchors(found)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_relative_links_lead_somewhere(page):
    targets = [t for t in LINK.findall(_prose(page)) if not re.match(r"[a-z]+:", t)]
    assert not [t for t in targets if not _exists(page, t)]


@pytest.mark.parametrize("page", PAGES[1:], ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_lines_are_bounded(page):
    long = [
        f"{number}: {len(line)}"
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1)
        if len(line) > MOST_COLUMNS
    ]
    assert not long


def test_the_guide_is_short():
    words = {
        page: len(page.read_text(encoding="utf-8").split())
        for page in PAGES
        if (page.parent.name in COUNTED or page.name == "index.md") and page.name != GROWS
    }
    assert 10_000 < sum(words.values()) < MOST_WORDS
    assert len((REPOSITORY / "README.md").read_text(encoding="utf-8").split()) <= MOST_README_WORDS


@pytest.mark.parametrize("folder", ["tutorials", "howto", "explanation"])
def test_a_page_begins_with_what_one_can_do_after_it(folder):
    for page in (DOCS / folder).glob("*.md"):
        begin = _prose(page)[:600]
        assert page.name == "index.md" or "After this page" in begin, page


def test_how_tos_name_no_decision():
    for page in (DOCS / "howto").glob("*.md"):
        assert not re.search(r"decisions?[ /]", _prose(page)), page


def test_every_page_is_reached():
    """Every page stands in a table of contents."""
    listed: set[Path] = set()
    for page in PAGES:
        for block in re.findall(r"```\{toctree\}(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL):
            for entry in block.splitlines():
                entry = entry.strip()
                if entry and not entry.startswith(":"):
                    listed |= (
                        {p.resolve() for p in page.parent.glob(f"{entry}.md")}
                        if "*" in entry
                        else {(page.parent / f"{entry}.md").resolve()}
                    )
    assert {p for p in PAGES if DOCS in p.parents} - listed == {DOCS / "index.md"}


def test_every_effect_has_its_section_and_its_picture():
    text = (DOCS / "reading" / "effects.md").read_text(encoding="utf-8")
    sections = re.findall(
        r"^### .+?\n\n`(\w+)`\n\n!\[[^\]]+\]\(\.\./images/effects/(\w+)\.png\)", text, re.MULTILINE
    )
    assert {name for name, _ in sections} == set(NAMES)
    assert all(name == picture for name, picture in sections)
    assert {p.stem for p in (DOCS / "images" / "effects").iterdir()} == set(NAMES)


def test_every_effect_is_drawn():
    text = (DOCS / "_effects.py").read_text(encoding="utf-8")
    panels = text[text.index("PANELS: dict") :].partition("\n}\n")[0]
    assert set(re.findall(r'^    "(\w+)": \(', panels, re.MULTILINE)) == set(NAMES)


def test_decisions_are_few_and_short():
    records = sorted((DOCS / "decisions").glob("0*.md"))
    assert len(records) <= MOST_DECISIONS
    for record in records:
        text = record.read_text(encoding="utf-8")
        assert text.startswith(f"# {record.name[:4]} ") and len(text.split()) < 350, record
        assert [f"## {part}" in text for part in ("Context", "Decision", "Consequence")] == [True] * 3, record


def test_every_picture_is_used():
    used = {name for page in PAGES for name in re.findall(r"images/([\w/-]+\.png)", page.read_text("utf-8"))}
    assert {str(p.relative_to(DOCS / "images")) for p in (DOCS / "images").rglob("*.png")} == used


def test_every_object_that_can_be_pressed_has_its_page():
    made = re.search(
        r"^OBJECTS = \(([^)]*)\)", (DOCS / "_touch.py").read_text(encoding="utf-8"), re.MULTILINE
    )
    linked = re.findall(r"touch/([\w-]+)\.html", (DOCS / "touch.md").read_text(encoding="utf-8"))
    assert made and set(re.findall(r'"([^"]+)"', made[1])) == set(linked)
