"""A check-up: each finding with what to do, and a picture of the stretch where it shows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.recording.recording import Recording
from palpate.operations._written import open_words
from palpate.reconstruction.checks.finding import OF_A_KNOWN_OBJECT, Checkup, Finding, Way
from palpate.reconstruction.checks.samples import CHANNELS
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.page import drawn, file_words, subplots
from palpate.show.quantities import readable
from palpate.show.scenery import add_path, look_around
from palpate.words import counted

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pyvista import Plotter

_QUIET = 0.45
"""How strongly a channel is drawn that a finding is not about."""
_MOST = 8000
_MARGIN = 0.35


def story(result: Checkup) -> say.Story:
    """The findings, each with its stretch."""
    yield say.Title(f"Check-up of {result.recording.name}", suffixed=True, pictures="own")
    recording, findings = result.recording, result.findings
    looked = "samples, presses and modulus" if result.full else "samples and presses"
    said = f"{counted(len(findings), 'finding')}, {len(result.grave)} grave"
    said = said if findings else f"no findings in its {looked}"
    presses = {None: "", 1: ", 1 press"}.get(result.presses, f", {result.presses} presses")
    said = f"{recording.name}, {recording.duration_s:.1f} s{presses}: {said}"
    yield say.Headline(said, on=say.TEXT)
    yield say.Headline(_lead(result.grave) if result.grave else said, on=say.PAGE)
    yield say.Sentence(_meaning(result), on=say.PAGE)
    yield say.Next(_next_steps(result))
    yield from (say.TextLine(finding.line()) for finding in findings)
    if findings:
        yield say.Rows(
            ["finding", "grave", "adds to the modulus's error", "how sure"],
            [[f.name, "grave" if f.grave else "-", _share(f.error), f.sure] for f in findings],
        )
    shaded = "; the stretches of the findings are shaded" if findings else ""
    yield say.Picture(
        lambda: drawn(draw, result, 10, 3), f"Force over the whole recording{shaded}.", name="whole"
    )
    for k, finding in enumerate(findings, 1):
        yield say.Section(
            f"{k}. {finding.name}{' (grave)' if finding.grave else ''}",
            _found(result, finding, k),
            unfolded=k == 1,
        )
    yield say.Section("What was measured?", [
        say.Rows(["quantity", "here", "usual"], (_seen(*row) for row in result.seen))
    ])  # fmt: skip


def _found(result: Checkup, finding: Finding, number: int) -> say.Story:
    recording = result.recording
    yield say.Sentence(finding.saw)
    yield say.Sentence(f"How sure: {finding.sure}. What to do: {finding.todo}")
    if finding.grave:
        yield from (say.Detail(_way(result, way)) for way in finding.ways)
    yield say.Picture(lambda: stretch_figure(recording, finding), _caption(finding), name=f"finding-{number}")


KEYS: tuple[say.Key, ...] = (
    "recording=recording.name",
    ("grave", lambda result: len(result.grave)),
    "findings",
    ("seen", lambda result: [dict(zip(("what", "value", "usual"), row, strict=True)) for row in result.seen]),
)


def place(result: Checkup, plotter: Plotter) -> None:
    """The tip's path, the stretches in question coloured."""
    flagged = np.zeros(len(result.recording.t))
    for k, finding in enumerate(reversed(result.findings)):
        if finding.stretch:
            a, b = np.searchsorted(result.recording.t, finding.stretch)
            flagged[a : b + 1] = k + 1
    add_path(plotter, result.recording.position, flagged, "finding (0: none)")
    look_around(plotter, np.array([0.0, 0.0, 1.0]), result.recording.position)


def draw(result: Checkup, ax: Axes) -> None:
    """Length of the force (N) over time (s); the findings' stretches shaded, grave ones red."""
    recording = result.recording
    rows = _rows(0, len(recording.t))
    ax.plot(recording.t[rows], recording.force_n[rows], lw=0.7, color=COLOURS["measured"])
    length = recording.duration_s
    for k, finding in enumerate(reversed(result.findings)):
        if finding.stretch is None:
            continue
        begin, end = finding.stretch
        colour = COLOURS["grave" if finding.grave else "finding"]
        ax.axvspan(begin, max(end, begin + 0.003 * length), color=colour, alpha=0.25, zorder=0)
        number = len(result.findings) - k
        ax.text(begin, 0.97, str(number), transform=ax.get_xaxis_transform(), va="top", fontsize=9)
    ax.set(xlabel="time [s]", ylabel="force magnitude [N]", xlim=(recording.t[0], recording.t[-1]))


def _seen(words: str, here: float, usual: float) -> list[object]:
    label, values = readable(words, [here, usual])
    return [label, *values]


def _lead(grave: Sequence[Finding]) -> str:
    """What is wrong, in a few words; its figures stand in the finding's chapter."""
    first, *more = grave
    beside = f"; and {len(more)} more" if more else ""
    return f"Not to be used as it is: {first.name}, {first.saw.partition(': ')[0]}{beside}"


def _meaning(result: Checkup) -> str:
    if not result.findings:
        return "Nothing was found that would move the modulus beyond its interval."
    if any(f.grave for f in result.findings):
        if any(way in OF_A_KNOWN_OBJECT for finding in result.grave for way in finding.ways):
            return "No model is made of it until it is said what the object is."
        return "The model could be another object's: `palpate reconstruct` refuses this without --force."
    return "The modulus's interval is widened by what was found; the model can be made as it is."


def _next_steps(result: Checkup) -> list[str]:
    if result.grave:
        first, *_ = result.grave
        whose = {way.says: way for finding in result.grave for way in finding.ways}
        return [first.todo, *(_way(result, way) for way in whose.values())]
    return [f"make a model of it: `palpate reconstruct {file_words(result.recording.path, 'REC')} -o MODEL`"]


def _way(result: Checkup, way: Way) -> str:
    """When to go on so, and the command."""
    return f"{way.says}: `{open_words(result.opened or {'files': (result.recording,)}, way.options)}`"


def stretch_figure(recording: Recording, finding: Finding) -> Figure:
    """Position (mm, from its mean) and force (N) around the finding's stretch; its channels stand out."""
    figure, axes = subplots(2, 1, figsize=(10, 4.6), sharex=True)
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
                    color=COLOURS["xyz"[k]], alpha=1.0 if loud else _QUIET, label=name)  # fmt: skip
        if (begin, end) != whole:
            ax.axvspan(begin, end, color=COLOURS["finding"], zorder=0)
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
