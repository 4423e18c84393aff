"""The page of a check-up: each finding with what to do, and a picture of the stretch where it shows."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mechanics.recording import Recording
from palpate.report.exploration_figures import FORCE_COLOUR, PEAK_COLOUR, PHASE_COLOUR
from palpate.report.page import Page, save_figures
from palpate.report.quantities import readable
from reconstruct.checks.finding import Finding
from reconstruct.checks.samples import CHANNELS

if TYPE_CHECKING:
    from palpate.results.check import Checkup

QUIET = ("#8d99ae", "#b8b08d", "#a3b899")
_LOUD = ("#c1121f", "#9d4edd", "#d97706")
_MOST = 8000
_MARGIN = 0.35


def write_report(path: Path | str, checkup: Checkup) -> Path:
    """Write the page, and its figures as PNGs into the folder PATH without suffix; returns its path."""
    path = Path(path)
    path = path if path.suffix else path.with_suffix(".html")
    figures = {
        f"finding-{k + 1}": stretch_figure(checkup.recording, f) for k, f in enumerate(checkup.findings)
    }
    whole, ax = plt.subplots(figsize=(10, 3), layout="constrained")
    over_time(ax, checkup)
    figures["whole"] = whole
    save_figures(path.with_suffix(""), figures)
    page = Page(f"Check-up of {checkup.recording.name}")
    page.lead(checkup.lines()[0] + ".")
    page.paragraph(_meaning(checkup))
    page.next_step(_what_next(checkup))
    if checkup.findings:
        page.table(
            ["finding", "grave", "adds to the modulus's error", "how sure"],
            [[f.name, "grave" if f.grave else "-", _share(f.error), f.sure] for f in checkup.findings],
        )
    shaded = "; the stretches of the findings are shaded" if checkup.findings else ""
    page.figure(whole, f"Force over the whole recording{shaded}.")
    for k, finding in enumerate(checkup.findings):
        page.heading(f"{k + 1}. {finding.name}{' (grave)' if finding.grave else ''}")
        page.paragraph(f"{finding.saw[0].upper()}{finding.saw[1:]}.")
        page.paragraph(f"How sure: {finding.sure}. What to do: {finding.todo}.")
        page.figure(figures[f"finding-{k + 1}"], _caption(finding))
    page.heading("What was measured")
    page.table(["quantity", "here", "usual"], [_seen(*row) for row in checkup.seen])
    for figure in figures.values():
        plt.close(figure)
    return page.write(path)


def _seen(words: str, here: float, usual: float) -> list[object]:
    label, values = readable(words, [here, usual])
    return [label, *values]


def _meaning(checkup: Checkup) -> str:
    if not checkup.findings:
        return "Nothing stands out that would move the modulus beyond its interval."
    if any(f.grave for f in checkup.findings):
        return "The model could be another object's: `palpate reconstruct` refuses this without --force."
    return "The modulus's interval is widened by what was found; the model can be made as it is."


def _what_next(checkup: Checkup) -> str:
    if any(f.grave for f in checkup.findings):
        return f"What to do next: {checkup.findings[0].todo}."
    return f"What to do next: `palpate reconstruct {checkup.recording.path or 'REC'} -o MODEL`."


def over_time(ax: Axes, checkup: Checkup) -> None:
    """Length of the force (N) over time (s); the findings' stretches shaded, grave ones red."""
    recording = checkup.recording
    rows = _rows(0, len(recording.t))
    ax.plot(recording.t[rows], recording.force_n[rows], lw=0.7, color=FORCE_COLOUR)
    length = recording.duration_s
    for k, finding in enumerate(reversed(checkup.findings)):
        if finding.stretch is None:
            continue
        begin, end = finding.stretch
        colour = PEAK_COLOUR if finding.grave else PHASE_COLOUR
        ax.axvspan(begin, max(end, begin + 0.003 * length), color=colour, alpha=0.25, zorder=0)
        number = len(checkup.findings) - k
        ax.text(begin, 0.97, str(number), transform=ax.get_xaxis_transform(), va="top", fontsize=9)
    ax.set(xlabel="time [s]", ylabel="force magnitude [N]", xlim=(recording.t[0], recording.t[-1]))


def stretch_figure(recording: Recording, finding: Finding) -> Figure:
    """Position (mm, from its mean) and force (N) around the finding's stretch; its channels stand out."""
    figure, axes = plt.subplots(2, 1, figsize=(10, 4.6), sharex=True, layout="constrained")
    whole = (float(recording.t[0]), float(recording.t[-1]))
    begin, end = finding.stretch or whole
    margin = max(_MARGIN * (end - begin), 10 * float(np.median(np.diff(recording.t))))
    a, b = np.searchsorted(recording.t, [begin - margin, end + margin])
    rows = _rows(int(a), max(int(b), int(a) + 2))
    t = recording.t[rows]
    position = 1e3 * (recording.position[rows] - recording.position[rows].mean(axis=0))
    marker = "." if len(t) < 150 else None
    for ax, values, names in zip(
        axes, (position, recording.force_on_tool[rows]), (CHANNELS[:3], CHANNELS[3:]), strict=True
    ):
        for k, name in enumerate(names):
            loud = name in finding.channels
            ax.plot(t, values[:, k], marker=marker, lw=1.5 if loud else 0.8, zorder=3 if loud else 2,
                    color=_LOUD[k] if loud else QUIET[k], label=name)  # fmt: skip
        if (begin, end) != whole:
            ax.axvspan(begin, end, color=PHASE_COLOUR, zorder=0)
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False)
    axes[0].set_ylabel("position less its mean [mm]")
    axes[1].set(ylabel="force on the tool [N]", xlabel="time [s]")
    return figure


def _rows(a: int, b: int) -> np.ndarray:
    """Sample numbers of [a, b), thinned to what a picture shows."""
    return np.arange(a, b, max(1, (b - a) // _MOST))


def _caption(finding: Finding) -> str:
    where = "the whole recording"
    if finding.stretch is not None:
        where = f"{finding.stretch[0]:.2f} to {finding.stretch[1]:.2f} s"
    return f"{finding.name}: {where}" + (f"; {', '.join(finding.channels)}" if finding.channels else "") + "."


def _share(error: float) -> str:
    return f"{100 * error:.0f} %" if np.isfinite(error) else "unknown"
