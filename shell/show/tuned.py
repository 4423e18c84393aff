"""A simulator's tuned settings: what was moved, what it costs, and whether it carries over."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.diagnosis.other_simulator.tuned import Priced, Tuned, as_json
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.words import force_words, listed, percent, spoken

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def story(result: Tuned) -> say.Story:
    """What was moved; the certificate; the front; what no setting reaches."""
    yield say.Title(f"{result.simulator}: settings that meet the measured force")
    yield say.Headline(_lead(result))
    for each in result.moved:
        yield say.Detail(f"{each.name}: {each.before:.4g} -> {each.after:.4g} ({each.term})")
    cost = f"{result.ms_per_step:.3g} ms a step (before: {result.ms_per_step_before:.3g})"
    yield say.Detail(f"costs {cost}, {result.s_per_s:.3g} s of the processor a simulated second in contact")
    yield say.TextLine("certificate, on what was not tuned on:")
    yield say.Rows(
        ["  not tuned on", "before [mN]", "after [mN]", "known to [mN]"],
        [
            ["  held-out presses", _mn(result.gap_before_n), _mn(result.gap_after_n), _mn(result.noise_n)],
            *(
                [f"  {s.name}", _mn(s.gap_before_n), _mn(s.gap_after_n), _mn(s.bound_n)]
                for s in result.unseen
            ),
        ],
        (-20, 12, 11, 14),
        on=say.BOTH,
    )
    yield say.Sentence(_certified(result))
    yield say.TextLine("error against cost, of all that was tried:")
    yield say.Rows(
        ["  ms a step", "error [mN]", "moved"],
        [[f"  {p.ms_per_step:.3g}", _mn(p.gap_n), _words(p)] for p in result.front],
        (-12, 11, 44),
        on=say.BOTH,
    )
    yield say.Sentence(_unreached(result))
    for note in result.notes:
        yield say.Note(note)


def _mn(newtons: float) -> str:
    return f"{1e3 * newtons:.3g}" if math.isfinite(newtons) else "not done"


def _words(point: Priced) -> str:
    return ", ".join(f"{name}={value:.4g}" for name, value in point.moved.items()) or "nothing"


def _lead(result: Tuned) -> str:
    gaps = f"{force_words(result.fitted_before_n)} -> {force_words(result.fitted_after_n)}"
    met = result.fitted_after_n <= result.target_n
    if not result.moved:
        if met:
            return (
                f"{result.simulator} meets the measured force as it is ({force_words(result.gap_before_n)})"
            )
        return f"{result.simulator}: no setting that was tried leaves less than {gaps.split(' -> ')[0]}"
    names = spoken(each.name for each in result.moved)
    return f"{result.simulator}: {names} moved, {gaps} off" + ("" if met else ", which is not yet met")


def _certified(result: Tuned) -> str:
    if result.undone:
        why = "interrupted" if result.interrupted else "the time was over"
        lacks = f"not done ({why}): {listed(result.undone)} after tuning; "
    else:
        lacks = ""
    if not result.worse:
        if result.undone:
            return f"{lacks}whether it carries over to them is not known"
        return "it carries over: as far as each force is known, nowhere is the error larger than before"
    farther = "farther off than before, wherever the force lies within what is known"
    return f"{lacks}it does not carry over to {listed(result.worse)}: {farther}"


def _unreached(result: Tuned) -> str:
    ideal = "not run in time" if math.isnan(result.law_n) else force_words(result.law_n)
    asked = (
        f"asked were {force_words(result.target_n)} (noise {force_words(result.noise_n)}, an ideal elastic "
        f"simulation {ideal})"
    )
    if result.fitted_after_n <= result.target_n:
        return f"{asked}: met"
    ended = "it was interrupted" if result.interrupted else "the time was over" if result.time_is_up else ""
    out_of_time = f"; {ended} before all was tried" if ended else ""
    only = f"only a modulus {percent(abs(result.scale - 1))} {'higher' if result.scale > 1 else 'lower'} "
    return (
        f"{asked}; the least that any setting reached is {force_words(result.least_n)}{out_of_time}; {only}"
        f"would hide more of it, down to {force_words(result.scaled_n)}, and would be wrong elsewhere"
    )


KEYS: tuple[say.Key | Callable[[Tuned], dict], ...] = (as_json,)


def draw(result: Tuned, ax: Axes) -> None:
    """Error over cost."""
    ax.plot(
        [p.s_per_s for p in result.front], [1e3 * p.gap_n for p in result.front], "o-", color=COLOURS["found"]
    )
    ax.axhline(1e3 * result.target_n, ls=":", color=COLOURS["reference"], label="asked")
    ax.set(xscale="log", xlabel="processor seconds a simulated second", ylabel="error [mN]")
    ax.legend(frameon=False)


def save(result: Tuned, path: Path | str) -> Path:
    """The settings in that simulator's own file."""
    from palpate.exporting.settings import write_settings

    return write_settings(path, result)
