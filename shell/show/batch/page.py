"""The page of a batch: a sortable table of all recordings, and how far explorations of one object agree."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np

from palpate.batching.plan import THUMBNAIL
from palpate.batching.summary import Batch, BatchEntry
from palpate.diagnosis.compare.models import RIVALS
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.diagnosis.words import short_verdict
from palpate.show.page import file_words, new_figure
from palpate.words import counted, kpa, mn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_OBJECTS = 12
"""That are drawn; the table beside has all."""


@dataclass(frozen=True)
class Cell:
    """text: HTML; by: what its column is sorted by, '' where it is not known; kind: '', words or picture."""

    text: str = ""
    by: Any = ""
    kind: str = ""


_NAMED = 12
"""Recordings and objects that a terminal names."""


def story(result: Batch) -> say.Story:
    """What came out; on the page, thumbnails and reports are linked where they lie, below its folder."""
    yield say.Title(f"Batch of {counted(len(result.entries), 'recording')}")
    yield say.Markup(f"<style>\n{_file('batch.css')}</style>")
    yield from _lines(result)
    yield say.Headline(lead(result), on=say.PAGE)
    yield say.Detail(meaning(result), on=say.PAGE)
    yield say.Next(next_steps(result))
    if result.agreements:
        yield say.Section("Do explorations of one object agree?", _agreement(result))
    yield say.Section("What came of each recording?", _page(result), unfolded=True)


def _lines(result: Batch) -> say.Story:
    """In a terminal."""
    reused = f"{result.tasks} tasks, {result.reused} of them finished before."
    yield say.Headline(f"{lead(result)} {reused}", on=say.TEXT)
    yield from (say.Detail(_entry_words(entry), on=say.TEXT) for entry in result.entries[:_NAMED])
    if (more := len(result.entries) - _NAMED) > 0:
        yield say.Detail(f"and {more} more (table, or summary.csv)", on=say.TEXT)
    for a in result.agreements[:_NAMED]:
        yield say.TextLine(
            f"{a.object}: {a.count} explorations, {kpa(a.young_modulus_pa)}, spread {100 * a.spread:.1f} %, "
            f"of their own intervals {100 * a.expected:.1f} %"
        )
    if result.undescribed:
        names = ", ".join(path.name for path in result.undescribed[:3])
        rest = f" and {len(result.undescribed) - 3} more" if len(result.undescribed) > 3 else ""
        yield say.TextLine(f"left out, as no .toml next to them describes them: {names}{rest}")
    yield say.TextLine(f"written to {result.folder / 'index.html'}")


def _entry_words(entry: BatchEntry) -> str:
    row, words = entry.row, []
    if row.young_modulus_pa is not None:
        low, high = row.young_modulus_lo_pa or np.nan, row.young_modulus_hi_pa or np.nan
        words.append(f"{kpa(row.young_modulus_pa)} ({low / 1e3:.2f} to {high / 1e3:.2f})")
    if row.gap_before_n is not None and row.gap_after_n is not None:
        gaps = f"gap {1e3 * row.gap_before_n:.0f} to {mn(row.gap_after_n)}"
        words.append(f"{verdict_words(entry)}, {gaps}")
    if row.status != "done":
        words.append(row.status)
    return f"{row.recording}: {'; '.join(words)}" + (f": {row.reason}" if row.reason else "")


def _page(result: Batch) -> say.Story:
    if len(result.entries) > 8:
        yield say.Markup(
            '<p><input id="find" type="search" placeholder="find: a name, an object, a verdict" '
            'aria-label="find recordings"></p>'
        )
    yield say.Markup(_recordings(result))
    told = []
    if "diagnose" in result.steps:
        told.append("of the simplest simulation (small deformations, one stiffness), and with what is found")
    if "compare" in result.steps:
        told.append("of FEM and of the best 1D model as they are, fitted without those presses")
    if told:
        yield say.Sentence(f"Forces in mN are root mean square errors at held-out places: {'; '.join(told)}")
    yield say.Markup('<p>The table as a file: <a href="summary.csv">summary.csv</a>.</p>')
    if cost := _cost(result):
        yield say.Section("What did it cost?", [say.Markup(cost)])
    yield say.Markup(f"<script>\n{_file('batch.js')}</script>")


def _file(name: str) -> str:
    return files(__package__).joinpath(name).read_text(encoding="utf-8")


def lead(result: Batch) -> str:
    """How many are done, failed and waiting, in a sentence."""
    count = {s: sum(e.row.status == s for e in result.entries) for s in ("done", "failed", "waiting")}
    parts = [f"{count['done']} of {counted(len(result.entries), 'recording')} done"]
    if count["failed"]:
        parts.append(f"{count['failed']} failed, with the reason next to it")
    if count["waiting"]:
        parts.append(f"{count['waiting']} not finished: run the same command again")
    return "; ".join(parts) + "."


def meaning(result: Batch) -> str:
    """What the moduli of one object explored more than once say, or how far the objects lie apart."""
    known = [e.row.young_modulus_pa for e in result.entries if e.row.young_modulus_pa]
    if result.agreements:
        worst = max(result.agreements, key=lambda a: a.spread)
        return (
            f"Explorations of one object differ by up to {100 * worst.spread:.1f} % in modulus "
            f"({worst.object}); their own intervals let expect {100 * worst.expected:.1f} %."
        )
    if len(known) > 1:
        return (
            f"Moduli from {min(known) / 1e3:.1f} to {kpa(max(known), '.1f')}; no object was explored twice."
        )
    return "No object was explored twice, so nothing is said about how far explorations agree."


def next_steps(result: Batch) -> list[str]:
    """What to do with the answers."""
    first = next((e.row.recording for e in result.entries if e.row.status == "done"), None)
    if any(e.row.status != "done" for e in result.entries):
        return ["mend what a row names, and run the same command again; what is done is kept"]
    feel = (
        f"`palpate touch {file_words(result.folder / first / 'model', '')}`"
        if first
        else "`palpate touch OUT/NAME/model`"
    )
    return ["open a recording's page by its name", f"feel one: {feel}"]


def _agreement(result: Batch) -> say.Story:
    most = f" The {MOST_OBJECTS} objects with most explorations."
    yield say.Picture(
        lambda: agreement_figure(result),
        "Young's modulus of every exploration with its 95 % interval, relative to the mean of its object."
        + (most if len(result.agreements) > MOST_OBJECTS else ""),
    )
    heads = ["object", "recordings", "mean modulus [kPa]", "spread between them [%]", "95 % interval of it",
             "expected of their own intervals [%]"]  # fmt: skip
    rows = [
        [
            Cell(html.escape(a.object), a.object, "words"),
            Cell(str(a.count), a.count),
            Cell(f"{a.young_modulus_pa / 1e3:.2f}", a.young_modulus_pa),
            Cell(f"{100 * a.spread:.1f}", a.spread),
            Cell("{:.1f} to {:.1f}".format(*(100 * v for v in a.spread_ci95)), a.spread_ci95[0]),
            Cell(f"{100 * a.expected:.1f}", a.expected),
        ]
        for a in result.agreements
    ]
    yield say.Markup(_table(heads, [("", row) for row in rows]))
    yield say.Sentence(
        "Spread: standard deviation of ln E between explorations, about the relative one. Where it is larger "
        "than what the recordings' own intervals let expect, something differs between the explorations that "
        "no single one of them can see. Objects are distinguished by the names that the recordings give them."
    )


def _recordings(result: Batch) -> str:
    heads = ["", "recording", "object", "presses", "modulus [kPa]"]
    heads += (
        ["verdict", "simplest simulation off [mN]", "with the verdict [mN]"]
        if "diagnose" in result.steps
        else ["status"]
    )
    heads += ["error of FEM [mN]", "of best 1D [mN]"] if "compare" in result.steps else []
    rows = [(e.row.status, _row(result, e)) for e in result.entries]
    return _table([*heads, "CPU [s]"], rows, "recordings")


def _row(result: Batch, entry: BatchEntry) -> list[Cell]:
    row, values = entry.row, entry.values
    cells = [
        _thumbnail(result, row.recording),
        Cell(_link(result, row.recording, "reconstruct", row.recording), row.recording, "words"),
        Cell(html.escape(entry.object or ""), entry.object or "", "words"),
        _number(values.get("reconstruct", {}).get("presses"), 1, 0),
        _modulus(entry),
        _verdict(result, entry),
    ]
    if "diagnose" in result.steps:
        cells += [_number(value, 1e3, 0) for value in (row.gap_before_n, row.gap_after_n)]
    if "compare" in result.steps:
        rmse = values.get("compare", {}).get("rmse_n")
        if rmse is None:
            cells += [Cell(), Cell()]
        else:
            best = min(rmse[name] for name in RIVALS)
            fem = _link(result, row.recording, "compare", f"{1e3 * rmse['fem']:.0f}")
            cells += [Cell(fem, rmse["fem"]), _number(best, 1e3, 0)]
    cpu = sum(seconds for seconds, _ in entry.cost.values())
    return [*cells, _number(cpu or None, 1, 0)]


def _verdict(result: Batch, entry: BatchEntry) -> Cell:
    """What was found, or why it was not."""
    row = entry.row
    said = verdict_words(entry) or row.status
    text = _link(result, row.recording, "diagnose", said)
    if row.status != "done":
        said = row.status
        text = f"{row.status}<small>{html.escape(row.reason)}</small>" if row.reason else row.status
    if entry.trace:
        text += f' <a href="{quote(row.recording)}/error.txt">trace</a>'
    return Cell(text, said, "words")


def _modulus(entry: BatchEntry) -> Cell:
    e, low, high = (getattr(entry.row, f"young_modulus_{end}pa") for end in ("", "lo_", "hi_"))
    if e is None:
        return Cell()
    known = low is not None and high is not None and low == low and high == high
    interval = f"<small>{low / 1e3:.2f} to {high / 1e3:.2f}</small>" if known else ""
    return Cell(f"<span>{e / 1e3:.2f}{interval}</span>", e)


def verdict_words(entry: BatchEntry) -> str:
    """'viscoelasticity', 'force bias or force drift', 'none', ...; '' where nothing was diagnosed."""
    found = entry.values.get("diagnose")
    if found is None:
        return ""
    return short_verdict(str(found["kind"]), found["effects"], found["candidates"])


def _thumbnail(result: Batch, name: str) -> Cell:
    if not (result.folder / name / THUMBNAIL).exists():
        return Cell(kind="picture")
    return Cell(f'<img loading="lazy" alt="" src="{quote(name)}/{THUMBNAIL}">', "", "picture")


def _link(result: Batch, name: str, step: str, text: str) -> str:
    there = text and (result.folder / name / f"{step}.html").exists()
    return f'<a href="{quote(name)}/{step}.html">{html.escape(text)}</a>' if there else html.escape(text)


def _number(value: Any, scale: float, digits: int) -> Cell:
    known = isinstance(value, int | float) and value == value
    return Cell(f"{value * scale:.{digits}f}", value) if known else Cell()


def _table(heads: Sequence[str], rows: Sequence[tuple[str, Sequence[Cell]]], name: str = "") -> str:
    """heads: '' cannot be sorted by; rows: (class, cells)."""
    wordy = [any(cells[k].kind == "words" for _, cells in rows) for k in range(len(heads))]
    top = "".join(
        f"<th{' class=words' if words else ''}>"
        + (f'<button type="button">{html.escape(text)}</button>' if text else "")
        + "</th>"
        for text, words in zip(heads, wordy, strict=True)
    )
    body = "\n".join(
        f'<tr class="{kind}">' + "".join(map(_cell, cells, heads)) + "</tr>" for kind, cells in rows
    )
    return f'<table class="sortable" id="{name}"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>'


def _cell(cell: Cell, name: str) -> str:
    kind = f' class="{cell.kind}"' if cell.kind else ""
    return f'<td{kind} data-name="{html.escape(name)}" data-by="{html.escape(str(cell.by))}">{cell.text}</td>'


def _cost(result: Batch) -> str:
    rows = []
    for step in result.steps:
        known = [e.cost[step] for e in result.entries if step in e.cost]
        if known:
            cpu, peak = np.array(known, dtype=float).T
            rows.append(
                [
                    Cell(step, step, "words"),
                    Cell(str(len(known)), len(known)),
                    *(_number(value, 1, 0) for value in (float(np.median(cpu)), float(cpu.max()))),
                    _number(float(peak.max()), 1e-6, 0),
                ]
            )
    heads = ["step", "recordings", "CPU, median [s]", "CPU, most [s]", "memory, most [MB]"]
    return _table(heads, [("", row) for row in rows]) if rows else ""


def agreement_figure(result: Batch) -> Figure:
    """Moduli of the explorations of every object with their intervals, over the object's mean."""
    count = min(len(result.agreements), MOST_OBJECTS)
    figure = new_figure(7, 1.1 + 0.55 * count, layout="constrained")
    draw_agreement(figure.subplots(), result)
    return figure


def draw_agreement(ax: Axes, result: Batch) -> Axes:
    """One line an object: each exploration's modulus over their mean, with its 95 % interval."""
    shown = result.agreements[:MOST_OBJECTS]
    for k, found in enumerate(shown):
        rows = [e.row for e in result.entries if e.object == found.object and e.row.young_modulus_pa]
        e, low, high = (
            np.array([getattr(row, f"young_modulus_{end}pa") for row in rows], dtype=float)
            / found.young_modulus_pa
            for end in ("", "lo_", "hi_")
        )
        at = k + (np.linspace(-0.3, 0.3, len(rows)) if len(rows) > 1 else np.zeros(1))
        ax.errorbar(e, at, xerr=[np.maximum(e - low, 0), np.maximum(high - e, 0)], fmt="o", ms=3.5,
                    lw=1, color=COLOURS["modulus"], ecolor=COLOURS["path"])  # fmt: skip
        ax.fill_betweenx(
            [k - 0.42, k + 0.42], 1 - found.spread, 1 + found.spread, color=COLOURS["interval"], zorder=0
        )
    ax.axvline(1, color=COLOURS["reference"], lw=0.8)
    labels = [f"{a.object}\n{kpa(a.young_modulus_pa, '.1f')}" for a in shown]
    ax.set_yticks(range(len(shown)), labels, fontsize=9)
    ax.invert_yaxis()
    ax.set_xlabel("modulus over the mean of its object; band: one standard deviation")
    return ax
