"""A self-contained HTML page: headings, paragraphs, tables and embedded pictures; nothing is fetched."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mechanics.files import PNG, Kind, atomic_file, reading

PAGE = Kind("a page of palpate", (b"<!doctype html>",), holds=b"Made by palpate", likely_bytes=1 << 23)

_STYLE = """
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1c2430; background: #fff; max-width: 62rem;
       margin: 2rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.7rem; margin-bottom: .2rem; } h2 { font-size: 1.25rem; margin-top: 2.2rem; }
p.lead { font-size: 1.15rem; } figure { margin: 1rem 0; } figure img { max-width: 100%; height: auto; }
figcaption { color: #55606e; font-size: .92rem; } table { border-collapse: collapse; margin: .8rem 0; }
th, td { padding: .3rem .8rem; border-bottom: 1px solid #d9dee5; text-align: right; }
th:first-child, td:first-child, td.words, th.words { text-align: left; }
th { border-bottom: 2px solid #8a96a5; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(16rem, 1fr)); gap: .9rem;
         margin: .9rem 0; }
.card { border: 1px solid #d9dee5; border-top: 4px solid #2a9d8f; border-radius: 4px; padding: .6rem .9rem;
        overflow-wrap: anywhere; }
.card h2 { margin: 0; font-size: .82rem; letter-spacing: .06em; text-transform: uppercase; color: #55606e; }
.card strong { display: block; font-size: 1.12rem; line-height: 1.3; margin: .15rem 0 .3rem; }
.card p { margin: 0; font-size: .95rem; line-height: 1.4; }
footer { margin-top: 3rem; color: #77808c; font-size: .85rem; }
"""


class Page:
    """Collects parts in order; `write` renders them whole."""

    def __init__(self, title: str) -> None:
        self.title = title
        self._parts: list[str] = [f"<h1>{html.escape(title)}</h1>"]

    def heading(self, text: str) -> None:
        """A section's heading."""
        self._parts.append(f"<h2>{html.escape(text)}</h2>")

    def lead(self, text: str) -> None:
        """The answer, in large type."""
        self._parts.append(f'<p class="lead">{html.escape(text)}</p>')

    def paragraph(self, text: str) -> None:
        """Plain words."""
        self._parts.append(f"<p>{html.escape(text)}</p>")

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
        self._parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")

    def part(self, text: str) -> None:
        """HTML as it is."""
        self._parts.append(text)

    def figure(self, picture: Any, caption: str) -> None:
        """A picture: a matplotlib figure, a PNG's path, or an (h, w, 3) uint8 image."""
        data = base64.b64encode(png_bytes(picture)).decode()
        caption = html.escape(caption)
        self._parts.append(
            f'<figure><img alt="{caption}" src="data:image/png;base64,{data}">'
            f"<figcaption>{caption}</figcaption></figure>"
        )

    def write(self, path: Path | str) -> Path:
        """Write the page whole; returns its path."""
        text = (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{html.escape(self.title)}</title><style>{_STYLE}</style></head><body>"
            + "\n".join(self._parts)
            + "<footer>Made by palpate. Forces are on the tool; SI units.</footer></body></html>"
        )
        with atomic_file(path, PAGE) as temporary:
            temporary.write_text(text, encoding="utf-8")
        return Path(path)


def png_bytes(picture: Any) -> bytes:
    """PNG data of a matplotlib figure, a PNG file, or an (h, w, 3) uint8 image."""
    if isinstance(picture, str | Path):
        with reading(picture):
            return Path(picture).read_bytes()
    buffer = io.BytesIO()
    if hasattr(picture, "savefig"):
        picture.savefig(buffer, format="png", dpi=110, bbox_inches="tight")
    else:
        from PIL import Image

        Image.fromarray(picture).save(buffer, format="PNG")
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
