"""A self-contained HTML page: headings, words, tables, pictures and one view of the object in 3D; nothing is
fetched."""

from __future__ import annotations

import base64
import gzip
import html
import io
import json
import os
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from importlib.resources import files
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.mechanics.disk.reading import reading
from palpate.mechanics.disk.writing import PNG, Kind, atomic_file
from palpate.mechanics.result import plain
from palpate.show.colours import style_sheet
from palpate.show.glossary import Terms
from palpate.show.story import (
    TEXT,
    Cards,
    Detail,
    Headline,
    Markup,
    Next,
    Note,
    Picture,
    Pictures,
    Rows,
    Section,
    Sentence,
    Story,
    Title,
    Turned,
)
from palpate.words import ended, headline, sentence, typed_word

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from palpate.mechanics.model.model import Model
    from palpate.show.view3d import View

PAGE = Kind("a page of palpate", (b"<!doctype html>",), holds=b"Made by palpate", likely_bytes=1 << 23)
_LEGIBLE = 0.6
"""Of a picture's own width: the least at which its letters can be read; a tap on a phone shows it so."""
_PHONE_PX = 400
"""Across a phone: a legible picture that is wider says that a tap shows it large."""
_MOST_COLUMNS = 3
"""Of a table that a phone shows side by side; in wider ones each row becomes a list."""
_FOOTER = (
    "<footer>Made by palpate. Positions are in the device's frame, forces are those on the tool.</footer>"
)
_DPI = 110
_MOST_SVG, _MOST_PARTS = 400_000, 3000
"""Bytes of a packed drawing that a page carries, and its dots and faces; a picture of more stays a PNG."""


class Page:
    """Collects parts in order; `write` renders them whole.

    folder: where named pictures are written too. bare: without its name and its last line, for a frame."""

    def __init__(self, title: str, folder: Path | None = None, *, bare: bool = False) -> None:
        self.title = title
        self._folder, self._bare = folder, bare
        self._parts: list[str] = [] if bare else [f"<h1>{html.escape(title)}</h1>"]
        self._live = self._inside = False
        self._chapters: list[str] = []
        self._first: int | None = None
        self._terms = Terms()
        self._result = ""
        self._drawn: list[tuple[Any, bytes, str]] = []

    def tell(self, story: Story) -> None:
        """Print a result's story, without what is for a terminal alone."""
        for block in story:
            if block.on == TEXT:
                continue
            match block:
                case Headline(text=text):
                    first, rest = headline(text)
                    self.lead(ended(first))
                    if rest:
                        self.paragraph(rest)
                case Sentence(text=text) | Note(text=text):
                    self.paragraph(sentence(text))
                case Detail(text=text):
                    self.paragraph(text)
                case Next(steps=steps):
                    self.next_steps(list(steps))
                case Cards(cards=cards):
                    self.cards(list(cards))
                case Rows(header=header, rows=rows):
                    self.table(header, list(rows))
                case Picture(caption=caption):
                    self.figure(self._picture(block), caption)
                case Pictures(pictures=pictures):
                    self.figures([(self._picture(each), each.caption) for each in pictures])
                case Turned(still=still, model=model):
                    if (view := block.view()) is not None:
                        self.view(view, self._picture(still), still.caption, model)
                case Markup(html=text):
                    self.part(text)
                case Section(heading="", blocks=blocks):
                    self.tell(blocks)
                case Section(heading=heading, blocks=blocks, unfolded=unfolded):
                    self._chapter(heading, blocks, unfolded)

    def heading(self, text: str) -> None:
        """A section's heading, of what is not folded."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def _chapter(self, heading: str, blocks: Story, unfolded: bool) -> None:
        """Blocks folded under a heading, left out where they come to nothing; within a chapter a heading."""
        outer, self._parts, inside = self._parts, [], self._inside
        self._inside = True
        self.tell(blocks)
        told, self._parts, self._inside = self._parts, outer, inside
        if not told:
            return
        if inside:
            self._parts += [f"<h3>{html.escape(heading)}</h3>", *told]
            return
        if self._first is None:
            self._first = len(self._parts)
        self._chapters.append(heading)
        self._parts += [folded(heading, len(self._chapters), unfolded), *told, "</details>"]

    def lead(self, text: str) -> None:
        """The answer, in large type."""
        self._parts.append(f'<p class="lead">{self._words(text)}</p>')

    def paragraph(self, text: str) -> None:
        """Plain words; what stands between backticks is code."""
        self._parts.append(f"<p>{self._words(text)}</p>")

    def next_steps(self, steps: Sequence[str]) -> None:
        """What to do now, marked; what stands between backticks is code. Nothing for none."""
        if steps:
            one = f" {self._words(steps[0])}." if len(steps) == 1 else ""
            several = "".join(f"<li>{self._words(step)}</li>" for step in steps[len(steps) == 1 :])
            listed = f"<ul>{several}</ul>" if several else ""
            self._parts.append(f'<div class="next">What to do next:{one}{listed}</div>')

    def cards(self, cards: Sequence[tuple[str, str, str]]) -> None:
        """Answers side by side: (question, answer in a few words, a sentence or two) each."""
        inside = "".join(
            f'<div class="card"><h2>{html.escape(question)}</h2><strong>{html.escape(answer)}</strong>'
            f"<p>{self._words(text)}</p></div>"
            for question, answer, text in cards
        )
        self._parts.append(f'<div class="cards">{inside}</div>')

    def table(self, header: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """A table; floats to four significant digits. A column in which no row says anything is left out."""
        told = [not rows or any(row[k] != "" for row in rows) for k in range(len(header))]
        header, *rows = (list(compress(row, told)) for row in (header, *rows))
        wordy = [any(_is_words(row[k]) for row in rows) for k in range(len(header))]
        kind = [' class="words"' if w else "" for w in wordy]
        head = "".join(f"<th{k}>{html.escape(h)}</th>" for k, h in zip(kind, header, strict=True))
        names = [f' data-of="{html.escape(h)}"' for h in header]
        body = "".join(
            "<tr>"
            + "".join(f"<td{k}{of}>{_cell(v)}</td>" for k, of, v in zip(kind, names, row, strict=True))
            + "</tr>"
            for row in rows
        )
        stacked = ' class="stack"' if len(header) > _MOST_COLUMNS else ""
        self._parts.append(
            scrolling(f"<table{stacked}><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")
        )

    def part(self, text: str) -> None:
        """HTML as it is."""
        self._parts.append(text)

    def figure(self, picture: Any, caption: str) -> None:
        """A picture: a matplotlib figure, a PNG's path, or an (h, w, 3) uint8 image."""
        self._parts.append(self._figure(picture, caption))

    def figures(self, pictures: Sequence[tuple[Any, str]]) -> None:
        """Small pictures side by side where there is room, each with its caption."""
        inside = "".join(self._figure(picture, caption) for picture, caption in pictures)
        self._parts.append(f'<div class="side">{inside}</div>')

    def result(self, figures: Mapping[str, Any]) -> None:
        """The numbers of the command's `--json`, which the page offers to keep."""
        text = json.dumps(plain(dict(figures)), indent=1).replace("<", "\\u003c")
        self._result = f'<script type="application/json" class="result">{text}</script>'

    def view(self, view: View, picture: Any, caption: str, model: Model | None = None) -> None:
        """The object to be turned, and of a model a button to press it; without scripts the picture with its
        caption."""
        self.turned(view, self._figure(picture, caption))
        if model is not None:
            from palpate.exporting.page.document import button

            self._parts.append(button(model))

    def turned(self, view: View, instead: str) -> None:
        """The object to be turned; instead: HTML for where there are no scripts."""
        self._parts.append(view.html(instead))
        self._live = True

    def html(self) -> str:
        """The whole page."""
        first = len(self._parts) if self._first is None else self._first
        return (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{html.escape(self.title)}</title><style>{style_sheet()}{file_text('page.css')}</style></head><body>"
            + "\n".join([*self._parts[:first], contents(self._chapters), *self._parts[first:]])
            + self._terms.listed()
            + self._result
            + ("" if self._bare else _FOOTER)
            + f"{self._scripts()}</body></html>"
        )

    def write(self, path: Path | str) -> Path:
        """Write the page whole; returns its path."""
        with atomic_file(path, PAGE) as temporary:
            temporary.write_text(self.html(), encoding="utf-8")
        return Path(path)

    def _scripts(self) -> str:
        own = f"<script>{file_text('page.js')}</script>"
        if not self._live:
            return own
        from palpate.show.view3d import scripts

        return scripts() + own

    def _words(self, text: str) -> str:
        return self._terms.linked(_words(_UNIT.sub(NO_BREAK, text)))

    def _picture(self, each: Picture) -> Any:
        """A picture, drawn; as a file too, drawn once for both, where it has a name and there is a folder."""
        picture = each.draw()
        if each.name and self._folder is not None:
            with atomic_file(self._folder / f"{each.name}.png", PNG) as temporary:
                temporary.write_bytes(self._once(picture)[0])
        return picture

    def _once(self, picture: Any) -> tuple[bytes, str]:
        """A picture's PNG and its packed drawing, made once."""
        for each, png, packed in self._drawn:
            if each is picture:
                return png, packed
        made = png_and_drawing(picture)
        self._drawn.append((picture, *made))
        return made

    def _figure(self, picture: Any, caption: str) -> str:
        (data, packed), said = self._once(picture), html.escape(caption)
        drawn = (
            f'<img alt="{said}" style="--legible:{_LEGIBLE * _width(data):.0f}px" '
            f'src="data:image/png;base64,{base64.b64encode(data).decode()}">'
        )
        words = f"<figcaption>{self._terms.linked(said)}</figcaption>"
        wide = ' class="wide"' if _LEGIBLE * _width(data) > _PHONE_PX else ""
        return f"<figure{wide}>{scrolling(drawn)}{words}{packed}</figure>"


def page_of(title: Title, story: Story, figures: Mapping[str, Any], path: Path | str) -> Path:
    """Write what follows a story's title as one page; figures: of its JSON. Returns its path."""
    path = Path(path)
    if title.suffixed and not path.suffix:
        path = path.with_suffix(".html")
    folders = {"own": path.with_suffix(""), "beside": path.parent}
    page = Page(title.text, folders.get(title.pictures))
    page.tell(story)
    page.result(figures)
    return page.write(path)


def folded(heading: str, number: int, unfolded: bool = False) -> str:
    """What begins a chapter, which `</details>` ends."""
    shown = " open" if unfolded else ""
    return (
        f'<details class="chapter" id="chapter-{number}"{shown}><summary><h2>{html.escape(heading)}</h2>'
        "</summary>"
    )


def contents(headings: Sequence[str]) -> str:
    """A table of contents, which `page.js` shows on a long page."""
    links = "".join(
        f'<a href="#chapter-{k}">{html.escape(heading)}</a>' for k, heading in enumerate(headings, 1)
    )
    return f'<nav class="contents" hidden>{links}</nav>' if links else ""


def scrolling(wide: str) -> str:
    """A table or picture that scrolls by itself where it is wider than the page, by keyboard too."""
    return f'<div class="scroll" tabindex="0">{wide}</div>'


@cache
def file_text(name: str) -> str:
    return files("palpate.show").joinpath(name).read_text(encoding="utf-8")


NO_BREAK = "\u00a0"
_UNIT = re.compile(
    r"(?<=\d) (?=(?:[mkMG]?(?:N|Pa|Hz)|[mcµ]?m|[mµ]?s|m?N/mm?)\b|%)(?=[^`]*(?:`[^`]*`[^`]*)*$)"
)
"""The space between a number and its unit or per cent sign, outside of what is marked as code."""


def _words(text: str) -> str:
    marked = re.sub(r"`(palpate [^`]+)`", r'<code class="command">\1</code>', html.escape(text))
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", marked)


def file_words(path: str | Path | None, otherwise: str) -> str:
    """A file as one would type it in a command, quoted where it must be: an embedded recording's name, else
    the path from here where that is shorter; `otherwise` for None."""
    if not path:
        return otherwise
    from palpate.scenes.embedded import embedded_names, embedded_recording

    name = Path(path).name.split(".")[0]
    if name in embedded_names() and embedded_recording(name).resolve().parent == Path(path).resolve().parent:
        return name
    return typed_word(min(str(path), os.path.relpath(path), key=len))


def feel_step(folder: str | Path | None, making: str) -> str:
    """How to feel a model: its folder, or first the command that writes it to MODEL where there is none."""
    if folder:
        return f"feel it: `palpate touch {file_words(folder, '')}`"
    return f"keep it, then feel it: `{making}`, `palpate touch MODEL`"


def png_and_drawing(picture: Any) -> tuple[bytes, str]:
    """PNG data of a picture, and its packed drawing if it has one."""
    if not hasattr(picture, "savefig"):
        return png_bytes(picture), ""
    with _laid_out(picture) as box:
        return _png(picture, box), _svg(picture, box)


@contextmanager
def _laid_out(figure: Figure) -> Iterator[Any]:
    """The part of a figure that holds anything, inches; inside, saving it does not lay it out anew, which
    takes as long as drawing."""
    from matplotlib import rcParams

    figure.draw_without_rendering()
    engine = figure.get_layout_engine()
    figure.set_layout_engine(None)
    try:
        yield figure.get_tightbbox().padded(rcParams["savefig.pad_inches"])
    finally:
        figure.set_layout_engine(engine)


def _png(figure: Figure, box: Any = "tight") -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=_DPI, bbox_inches=box)
    return buffer.getvalue()


def _svg(picture: Figure, box: Any) -> str:
    """A matplotlib figure as a packed drawing, for `page.js` to unpack; '' where it would be large."""
    if _parts(picture) > _MOST_PARTS:
        return ""
    from matplotlib import rc_context

    buffer = io.BytesIO()
    with rc_context({"svg.hashsalt": "palpate", "svg.fonttype": "none"}):
        picture.savefig(buffer, format="svg", bbox_inches=box, metadata={"Date": None})
    packed = base64.b64encode(gzip.compress(buffer.getvalue(), mtime=0)).decode()
    return f'<script type="text/plain" class="svg">{packed}</script>' if len(packed) < _MOST_SVG else ""


def _parts(picture: Any) -> int:
    """Of a matplotlib figure: what a drawing would hold one by one."""
    collections = (each for ax in picture.axes for each in ax.collections)
    return sum(max(len(each.get_paths()), len(each.get_offsets())) for each in collections)


def _width(png: bytes) -> int:
    """Pixels across, of a PNG's first chunk."""
    return int.from_bytes(png[16:20], "big")


def new_figure(width_in: float, height_in: float, **more: Any) -> Figure:
    """A matplotlib figure that no window holds; more: what `matplotlib.figure.Figure` takes."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in), **more)


def subplots(
    rows: int, columns: int, *, figsize: tuple[float, float], layout: Any = "constrained", **more: Any
) -> tuple[Figure, Any]:
    """A figure and its axes; figsize: inches; more: what `Figure.subplots` takes."""
    figure = new_figure(*figsize, layout=layout)
    return figure, figure.subplots(rows, columns, **more)


def drawn(
    draw: Callable[[Any, Axes], object],
    result: Any,
    width_in: float,
    height_in: float,
    layout: Any = "constrained",
) -> Figure:
    """A figure of one plot of a result."""
    figure = new_figure(width_in, height_in, layout=layout)
    draw(result, figure.subplots())
    return figure


def png_bytes(picture: Any) -> bytes:
    """PNG data of a matplotlib figure, a PNG file, or an (h, w, 3) uint8 image."""
    if isinstance(picture, str | Path):
        with reading(picture):
            return Path(picture).read_bytes()
    if hasattr(picture, "savefig"):
        return _png(picture)
    from matplotlib.image import imsave

    buffer = io.BytesIO()
    imsave(buffer, picture, format="png")
    return buffer.getvalue()


def _is_words(value: Any) -> bool:
    """Whether a cell holds a phrase, which reads better from the left."""
    return isinstance(value, str) and sum(c.isalpha() for c in value) > 12


def _cell(value: Any) -> str:
    if isinstance(value, float):
        if value != value:
            return "&ndash;"
        return f"{value:.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"
    return html.escape(str(value))
