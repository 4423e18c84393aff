"""A self-contained HTML page: headings, words, tables, pictures and one view of the object in 3D; nothing is
fetched."""

from __future__ import annotations

import base64
import html
import io
import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanics.files import PNG, Kind, atomic_file, reading

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from mechanics.model import Model
    from palpate.show.view3d import View

PAGE = Kind("a page of palpate", (b"<!doctype html>",), holds=b"Made by palpate", likely_bytes=1 << 23)
_LEGIBLE = 0.6
"""Of a picture's own width: the least at which its letters can be read; a phone scrolls the rest."""


class Page:
    """Collects parts in order; `write` renders them whole."""

    def __init__(self, title: str) -> None:
        self.title = title
        self._parts: list[str] = [f"<h1>{html.escape(title)}</h1>"]
        self._live = False

    def heading(self, text: str) -> None:
        """A section's heading."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def lead(self, text: str) -> None:
        """The answer, in large type."""
        self._parts.append(f'<p class="lead">{html.escape(text)}</p>')

    def paragraph(self, text: str) -> None:
        """Plain words; what stands between backticks is code."""
        self._parts.append(f"<p>{_words(text)}</p>")

    def next_step(self, text: str) -> None:
        """What to do now, marked; what stands between backticks is code."""
        self._parts.append(f'<p class="next">{_words(text)}</p>')

    def cards(self, cards: Sequence[tuple[str, str, str]]) -> None:
        """Answers side by side: (question, answer in a few words, a sentence or two) each."""
        inside = "".join(
            f'<div class="card"><h2>{html.escape(question)}</h2><strong>{html.escape(answer)}</strong>'
            f"<p>{html.escape(text)}</p></div>"
            for question, answer, text in cards
        )
        self._parts.append(f'<div class="cards">{inside}</div>')

    def table(self, header: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
        """A table; floats to four significant digits."""
        wordy = [any(_is_words(row[k]) for row in rows) for k in range(len(header))]
        kind = [' class="words"' if w else "" for w in wordy]
        head = "".join(f"<th{k}>{html.escape(h)}</th>" for k, h in zip(kind, header, strict=True))
        body = "".join(
            "<tr>" + "".join(f"<td{k}>{_cell(v)}</td>" for k, v in zip(kind, row, strict=True)) + "</tr>"
            for row in rows
        )
        self._parts.append(scrolling(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"))

    def part(self, text: str) -> None:
        """HTML as it is."""
        self._parts.append(text)

    def figure(self, picture: Any, caption: str) -> None:
        """A picture: a matplotlib figure, a PNG's path, or an (h, w, 3) uint8 image."""
        self._parts.append(_figure(picture, caption))

    def view(self, view: View, picture: Any, caption: str, model: Model | None = None) -> None:
        """The object to be turned, and of a model a button to press it; without scripts the picture with its
        caption."""
        self._parts.append(view.html(_figure(picture, caption)))
        self._live = True
        if model is not None:
            from palpate.exporting.page.button import button

            self._parts.append(button(model))

    def html(self) -> str:
        """The whole page."""
        return (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{html.escape(self.title)}</title><style>{_style()}</style></head><body>"
            + "\n".join(self._parts)
            + "<footer>Made by palpate. Positions are in the device's frame, forces are those on the tool."
            + f"</footer>{self._scripts()}</body></html>"
        )

    def write(self, path: Path | str) -> Path:
        """Write the page whole; returns its path."""
        with atomic_file(path, PAGE) as temporary:
            temporary.write_text(self.html(), encoding="utf-8")
        return Path(path)

    def _scripts(self) -> str:
        if not self._live:
            return ""
        from palpate.show.view3d import scripts

        return scripts()


def scrolling(wide: str) -> str:
    """A table or picture that scrolls by itself where it is wider than the page, by keyboard too."""
    return f'<div class="scroll" tabindex="0">{wide}</div>'


@cache
def _style() -> str:
    return files("palpate.show").joinpath("page.css").read_text(encoding="utf-8")


def _words(text: str) -> str:
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(text))


def _figure(picture: Any, caption: str) -> str:
    data = png_bytes(picture)
    caption = html.escape(caption)
    drawn = (
        f'<img alt="{caption}" style="--legible:{_LEGIBLE * _width(data):.0f}px" '
        f'src="data:image/png;base64,{base64.b64encode(data).decode()}">'
    )
    return f"<figure>{scrolling(drawn)}<figcaption>{caption}</figcaption></figure>"


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


def png_bytes(picture: Any) -> bytes:
    """PNG data of a matplotlib figure, a PNG file, or an (h, w, 3) uint8 image."""
    if isinstance(picture, str | Path):
        with reading(picture):
            return Path(picture).read_bytes()
    buffer = io.BytesIO()
    if hasattr(picture, "savefig"):
        picture.savefig(buffer, format="png", dpi=110, bbox_inches="tight")
    else:
        from matplotlib.image import imsave

        imsave(buffer, picture, format="png")
    return buffer.getvalue()


def save_figures(folder: Path | str, figures: dict[str, Any]) -> dict[str, Path]:
    """Write each picture as `folder/NAME.png`; returns the paths by name."""
    paths = {}
    for name, picture in figures.items():
        paths[name] = Path(folder) / f"{name}.png"
        with atomic_file(paths[name], PNG) as temporary:
            temporary.write_bytes(png_bytes(picture))
    return paths


def _is_words(value: Any) -> bool:
    """Whether a cell holds a phrase, which reads better from the left."""
    return isinstance(value, str) and sum(c.isalpha() for c in value) > 12


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return "&ndash;" if value != value else f"{value:.4g}"
    return html.escape(str(value))
