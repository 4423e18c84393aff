"""A result's story: what it has to say, once, as a list of blocks; a terminal, a page and JSON print it.

A kind of result yields its blocks in order; each printer takes those that it can print:

    block       terminal                      page
    Title       -                             its name
    Headline    a line                        large type
    Sentence    a line                        a paragraph, as a whole sentence
    TextLine    a line                        -
    Detail      a line, indented              a paragraph, as it is
    Note        a line, indented              a paragraph, as a whole sentence
    Cards       -                             answers side by side
    Rows        where its columns have widths a table
    Picture     -                             a picture; Pictures: small ones side by side
    Turned      -                             the object to be turned
    Next        its last lines                what to do now, marked
    Markup      -                             HTML as it is
    Section     -                             a chapter folded under its heading; inside one, a heading

`on` keeps a block to one of the two. What a block holds may be a generator or a function: it runs when a
printer comes to it, so that a terminal waits for no picture.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from palpate.mechanics.result import Key as Key
from palpate.mechanics.result import figures_of as figures_of

if TYPE_CHECKING:
    from palpate.mechanics.model.model import Model
    from palpate.show.view3d import View

BOTH, TEXT, PAGE = "both", "text", "page"


@dataclass(frozen=True)
class Told:
    """A block; on: BOTH, TEXT or PAGE."""

    on: str = field(default=BOTH, kw_only=True)


@dataclass(frozen=True)
class OnPage(Told):
    """A block that a terminal does not print."""

    on: str = field(default=PAGE, kw_only=True)


@dataclass(frozen=True)
class Title(OnPage):
    """Of a page: the first block of a story that has one. suffixed: a path without suffix gets '.html'.
    pictures: where named ones are written as files too: 'own', the folder of the page's name; 'beside', the
    page's folder; '', nowhere."""

    text: str
    suffixed: bool = False
    pictures: str = ""


@dataclass(frozen=True)
class Headline(Told):
    """The answer."""

    text: str


@dataclass(frozen=True)
class Sentence(Told):
    """What else is to be said; a page makes a whole sentence of it."""

    text: str


@dataclass(frozen=True)
class TextLine(Told):
    """What a terminal alone says."""

    text: str
    on: str = field(default=TEXT, kw_only=True)


@dataclass(frozen=True)
class Detail(Told):
    """What stands under a line."""

    text: str


@dataclass(frozen=True)
class Note(Told):
    """A reason or a remark, as whoever found it says it."""

    text: str


@dataclass(frozen=True)
class Next(Told):
    """What to do now; commands between backticks."""

    steps: Iterable[str]


@dataclass(frozen=True)
class Rows(OnPage):
    """widths: of a terminal's columns, negative to align them left."""

    header: Sequence[str]
    rows: Iterable[Sequence[Any]]
    widths: Sequence[int] = ()


@dataclass(frozen=True)
class Cards(OnPage):
    """(question, answer in a few words, a sentence or two) each."""

    cards: Iterable[tuple[str, str, str]]


@dataclass(frozen=True)
class Picture(OnPage):
    """name: of its file, where pictures are written as files too."""

    draw: Callable[[], Any]
    caption: str
    name: str = ""


@dataclass(frozen=True)
class Pictures(OnPage):
    """Small pictures side by side."""

    pictures: Iterable[Picture]


@dataclass(frozen=True)
class Turned(OnPage):
    """still: the picture where scripts are off. model: what can be pressed."""

    view: Callable[[], View | None]
    still: Picture
    model: Model | None = None


@dataclass(frozen=True)
class Markup(OnPage):
    html: str


@dataclass(frozen=True)
class Section(OnPage):
    """heading: '' for none; on a page a question. evidence: which the page of what it is a part of leaves
    out. unfolded: what is to be seen at once."""

    heading: str
    blocks: Iterable[Told]
    evidence: bool = False
    unfolded: bool = False


Story = Iterable[Told]


def lines_of(story: Story) -> list[str]:
    """What a terminal prints."""
    said: list[str] = []
    for block in story:
        match block:
            case Told(on="page"):
                continue
            case Headline(text=text) | Sentence(text=text) | TextLine(text=text):
                said.append(text)
            case Detail(text=text) | Note(text=text):
                said.append(f"  {text}")
            case Rows():
                said += _columns(block)
    return [line.replace("\u00a0", " ") for line in said]


def _columns(table: Rows) -> list[str]:
    rows = [table.header, *([str(cell) for cell in row] for row in table.rows)]
    return ["".join(map(_padded, row, table.widths, range(len(row)))) for row in rows]


def _padded(cell: str, width: int, column: int) -> str:
    if width < 0:
        return cell.ljust(-width)
    return cell.rjust(width) if len(cell) < width or not column else f"   {cell}"


def steps_of(story: Story) -> list[str]:
    """What to do with a result."""
    return [step for block in story if isinstance(block, Next) and block.on != PAGE for step in block.steps]
