"""The page of a batch: a sortable table of all recordings, and how far explorations of one object agree."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate.batching.run import Batch
from palpate.batching.steps import STEPS, THUMBNAIL
from palpate.batching.summary import Entry
from palpate.report.page import Page

MOST_OBJECTS = 12
"""That are drawn; the table beside has all."""

_STYLE = """<style>
body { max-width: 84rem; }
.wide { overflow-x: auto; } .wide td, .wide th { white-space: nowrap; padding: .3rem .6rem; }
.wide td.words { white-space: normal; min-width: 9rem; max-width: 22rem; overflow-wrap: anywhere; }
.wide th button { font: inherit; font-weight: 600; background: none; border: 0; padding: 0; cursor: pointer;
                  color: inherit; text-align: inherit; }
.wide th button::after { content: " \\2195"; color: #a3adb8; }
.wide th[aria-sort=ascending] button::after { content: " \\2191"; color: inherit; }
.wide th[aria-sort=descending] button::after { content: " \\2193"; color: inherit; }
.wide img { display: block; width: 5rem; height: 3.75rem; object-fit: contain; }
.wide small { color: #55606e; } tr.failed td { background: #fdf0ee; } tr.waiting td { background: #f6f7f9; }
#find { font: inherit; padding: .35rem .6rem; width: min(100%, 24rem); box-sizing: border-box;
        border: 1px solid #8a96a5; border-radius: 4px; }
</style>"""

_SCRIPT = """<script>
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells], body = table.tBodies[0];
  heads.forEach((head, column) => head.querySelector("button")?.addEventListener("click", () => {
    const up = head.getAttribute("aria-sort") !== "ascending";
    heads.forEach(other => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", up ? "ascending" : "descending");
    const value = row => row.cells[column].dataset.by;
    const number = text => text === "" ? NaN : Number(text);
    const rows = [...body.rows], numeric = rows.every(row => value(row) === "" || !isNaN(number(value(row))));
    rows.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      if (x === "" || y === "") return (x === "") - (y === "");  // what is not known comes last, always
      const order = numeric ? number(x) - number(y) : x.localeCompare(y, undefined, {numeric: true});
      return up ? order : -order;
    });
    body.append(...rows);
  }));
}
document.getElementById("find")?.addEventListener("input", event => {
  const words = event.target.value.toLowerCase().split(/\\s+/);
  for (const row of document.querySelectorAll("#recordings tbody tr")) {
    const text = row.textContent.toLowerCase();
    row.hidden = !words.every(word => text.includes(word));
  }
});
</script>"""


def write_report(path: Path, result: Batch, steps: Sequence[str]) -> Path:
    """Write the page; thumbnails and reports are linked where they lie, below the page's folder."""
    page = Page(f"Batch of {_count(len(result.entries), 'recording')}")
    page.part(_STYLE)
    page.lead(lead(result))
    if result.agreements:
        _agreement(page, result)
    page.heading("Recordings")
    if len(result.entries) > 8:
        page.part(
            '<p><input id="find" type="search" placeholder="find: a name, an object, a verdict" '
            'aria-label="find recordings"></p>'
        )
    page.part(_recordings(result, steps))
    _cost(page, result, steps)
    page.part(_SCRIPT)
    return page.write(path)


def lead(result: Batch) -> str:
    """How many are done, failed and waiting, in a sentence."""
    count = {s: sum(e.row.status == s for e in result.entries) for s in ("done", "failed", "waiting")}
    parts = [f"{count['done']} of {_count(len(result.entries), 'recording')} done"]
    if count["failed"]:
        parts.append(f"{count['failed']} failed, with the reason beside")
    if count["waiting"]:
        parts.append(f"{count['waiting']} not finished: run the same command again")
    return "; ".join(parts) + "."


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" + ("s" if number != 1 else "")


def _agreement(page: Page, result: Batch) -> None:
    page.heading("Repeatability: one object, explored more than once")
    page.figure(
        agreement_figure(result),
        "Young's modulus of every exploration with its 95 % interval, relative to the mean of its object."
        + (
            f" The {MOST_OBJECTS} objects with most explorations."
            if len(result.agreements) > MOST_OBJECTS
            else ""
        ),
    )
    heads = [
        ("object", True),
        ("recordings", False),
        ("mean modulus [kPa]", False),
        ("spread between them [%]", False),
        ("95 % interval of it", False),
        ("expected of their own intervals [%]", False),
    ]
    rows = [
        [
            _cell(html.escape(a.object), a.object, words=True),
            _cell(str(a.count), a.count),
            _cell(f"{a.young_modulus_pa / 1e3:.2f}", a.young_modulus_pa),
            _cell(f"{100 * a.spread:.1f}", a.spread),
            _cell("{:.1f} to {:.1f}".format(*(100 * v for v in a.spread_ci95)), a.spread_ci95[0]),
            _cell(f"{100 * a.expected:.1f}", a.expected),
        ]
        for a in result.agreements
    ]
    page.part(_table(heads, [("", row) for row in rows]))
    page.paragraph(
        "Spread: standard deviation of ln E between explorations, about the relative one. Where it is larger "
        "than what the recordings' own intervals let expect, something differs between the explorations that "
        "no single one of them can see."
    )


def agreement_figure(result: Batch) -> Figure:
    """Moduli of the explorations of every object with their intervals, over the object's mean."""
    count = min(len(result.agreements), MOST_OBJECTS)
    figure = Figure(figsize=(9, 1.2 + 0.55 * count), layout="constrained")
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
                    lw=1, color="#1d3557", ecolor="#8fa3bd")  # fmt: skip
        ax.fill_betweenx(
            [k - 0.42, k + 0.42], 1 - found.spread, 1 + found.spread, color="#2a9d8f", alpha=0.15
        )
    ax.axvline(1, color="#8a96a5", lw=0.8)
    labels = [f"{a.object}\n{a.young_modulus_pa / 1e3:.1f} kPa" for a in shown]
    ax.set_yticks(range(len(shown)), labels, fontsize=9)
    ax.invert_yaxis()
    ax.set_xlabel("modulus over the mean of its object; band: one standard deviation between explorations")
    return ax


def _recordings(result: Batch, steps: Sequence[str]) -> str:
    heads = [("", False), ("recording", True), ("object", True), ("status", True), ("presses", False),
             ("modulus [kPa]", False), ("95 % interval", False)]  # fmt: skip
    heads += [("held-out error: FEM, 1D [mN]", False)] if "compare" in steps else []
    heads += [("verdict", True), ("gap before [mN]", False), ("after", False)] if "diagnose" in steps else []
    heads += [("CPU s", False)]
    return _table(heads, [(e.row.status, _row(result, e, steps)) for e in result.entries], "recordings")


def _row(result: Batch, entry: Entry, steps: Sequence[str]) -> list[str]:
    row, values = entry.row, entry.values
    cells = [
        _thumbnail(result, row.recording),
        _cell(_link(result, row.recording, "reconstruct", row.recording), row.recording, words=True),
        _cell(html.escape(entry.object or ""), entry.object or "", words=True),
        _cell(_status(result, entry), row.status, words=True),
        _cell(*_number(values.get("reconstruct", {}).get("presses"), 1, 0)),
        _cell(*_number(row.young_modulus_pa, 1e-3, 2)),
        _interval(row.young_modulus_lo_pa, row.young_modulus_hi_pa),
    ]
    if "compare" in steps:
        rmse = values.get("compare", {}).get("rmse_n")
        if rmse is None:
            cells.append(_cell("", ""))
        else:
            best = min(value for name, value in rmse.items() if name != "fem")
            text = f"{1e3 * rmse['fem']:.0f}, {1e3 * best:.0f}"
            cells.append(_cell(_link(result, row.recording, "compare", text), rmse["fem"]))
    if "diagnose" in steps:
        said = verdict_words(entry)
        cells.append(_cell(_link(result, row.recording, "diagnose", said), said, words=True))
        cells += [_cell(*_number(value, 1e3, 0)) for value in (row.gap_before_n, row.gap_after_n)]
    cpu = sum(seconds for seconds, _ in entry.cost.values())
    return [*cells, _cell(*_number(cpu or None, 1, 0))]


def verdict_words(entry: Entry) -> str:
    """'viscoelasticity', 'force bias or force drift', 'none', ...; '' where nothing was diagnosed."""
    found = entry.values.get("diagnose")
    if found is None:
        return ""
    said = [name.replace("_", " ") for name in found["effects"]]
    if "unknown" in found["kind"]:
        said.append("something unknown")
    if found["candidates"] and not said:
        said = [" or ".join(name.replace("_", " ") for name in found["candidates"])]
    return " and ".join(said) or str(found["kind"])


def _status(result: Batch, entry: Entry) -> str:
    text = html.escape(entry.row.status)
    if entry.row.reason:
        text += f"<br><small>{html.escape(entry.row.reason)}</small>"
    if entry.trace:
        text += f' <a href="{quote(entry.row.recording)}/error.txt">trace</a>'
    return text


def _thumbnail(result: Batch, name: str) -> str:
    if not (result.folder / name / THUMBNAIL).exists():
        return "<td></td>"
    return f'<td><img loading="lazy" alt="" src="{quote(name)}/{THUMBNAIL}"></td>'


def _link(result: Batch, name: str, step: str, text: str) -> str:
    there = text and (result.folder / name / f"{step}.html").exists()
    return f'<a href="{quote(name)}/{step}.html">{html.escape(text)}</a>' if there else html.escape(text)


def _interval(low: float | None, high: float | None) -> str:
    if low is None or high is None or low != low or high != high:
        return _cell("", "")
    return _cell(f"{low / 1e3:.2f} to {high / 1e3:.2f}", (high - low) / (high + low))


def _number(value: Any, scale: float, digits: int) -> tuple[str, Any]:
    known = isinstance(value, int | float) and value == value
    return (f"{value * scale:.{digits}f}", value) if known else ("", "")


def _cell(text: str, by: Any, *, words: bool = False) -> str:
    """text: HTML; by: what the column is sorted by."""
    kind = ' class="words"' if words else ""
    return f'<td{kind} data-by="{html.escape(str(by))}">{text}</td>'


def _table(
    heads: Sequence[tuple[str, bool]], rows: Sequence[tuple[str, Sequence[str]]], name: str = ""
) -> str:
    """heads: (words, whether its cells are words); '' cannot be sorted. rows: (class, cells)."""
    top = "".join(
        f"<th{' class=words' if words else ''}>"
        + (f'<button type="button">{html.escape(text)}</button>' if text else "")
        + "</th>"
        for text, words in heads
    )
    body = "\n".join(f'<tr class="{kind}">{"".join(cells)}</tr>' for kind, cells in rows)
    return (
        f'<div class="wide"><table class="sortable" id="{name}"><thead><tr>{top}</tr></thead>'
        f"<tbody>{body}</tbody></table></div>"
    )


def _cost(page: Page, result: Batch, steps: Sequence[str]) -> None:
    known = {step: [e.cost[step] for e in result.entries if step in e.cost] for step in STEPS}
    rows = []
    for step in steps:
        if known[step]:
            cpu, peak = np.array(known[step], dtype=float).T
            rows.append([step, len(cpu), float(np.median(cpu)), float(cpu.max()), float(peak.max() / 1e6)])
    if rows:
        page.heading("What it cost")
        page.table(["step", "recordings", "CPU s, median", "most", "memory, most [MB]"], rows)
