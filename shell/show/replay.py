"""A replay: rendered against measured force along a recorded path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.render.force_error import said
from palpate.render.replay import ReplayResult
from palpate.show import story as say
from palpate.show.colours import COLOURS, colour_of
from palpate.show.curve import solved_rows
from palpate.show.page import file_words
from palpate.show.quantities import ERROR
from palpate.words import mn, unsettled_words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.render.exact import ExactReplay


def story(result: ReplayResult) -> say.Story:
    """How far rendered and measured force are apart."""
    noise = "" if result.noise_n is None else f" (the sensor's noise: {mn(result.noise_n, '.3g')})"
    yield say.Headline(
        f"{result.renderer}: rendered and measured force differ by {mn(result.rmse_n, '.3g')}, "
        f"{100 * result.relative:.3g} % of the measured {result.force_rms_n:.3g} N{noise}"
    )
    yield say.Detail(f"root mean square over {int(result.contact.sum())} samples in contact")
    if result.unsettled:
        yield say.Sentence(unsettled_words(result.unsettled, len(result.t)))
    if words := said(result.error_figures):
        yield say.Detail(words)
    if result.exact is not None:
        yield from _solved(result.exact)
    recording, model = file_words(result.recording.path, "REC"), file_words(result.model.path, "MODEL")
    yield say.Next([f"see what makes it: `palpate diagnose {recording} --model {model} --report PAGE.html`"])


def _solved(exact: ExactReplay) -> say.Story:
    """Law and solution at the deepest of each place."""
    yield say.Detail(f"solved at {len(exact.places)} places, and the forces are by it")
    yield solved_rows(
        "at the deepest [mm]",
        [(1e3 * p.depth_m[-1], p.law_n[-1], p.solved_n[-1]) for p in exact.places],
    )
    if exact.unsolved:
        yield say.Detail(f"{exact.unsolved} places keep the law: no equilibrium was found there")


def _exact(result: ReplayResult) -> dict[str, Any]:
    found = result.exact
    return {} if found is None else {"exact": {"unsolved_places": found.unsolved, "places": found.places}}


KEYS: tuple[say.Key, ...] = (
    "renderer",
    ("samples", lambda result: len(result.force_n)),
    ("contact_samples", lambda result: result.contact.sum()),
    "rmse_n",
    "force_rms_n",
    "relative_rmse=relative",
    ("peak_force_n", lambda result: np.linalg.norm(result.force_n, axis=1).max()),
    lambda result: {"unsettled_samples": result.unsettled} if result.unsettled else {},
    lambda result: result.error_figures,
    _exact,
    lambda result: {} if result.noise_n is None else {"noise_n": result.noise_n},
)


def draw(result: ReplayResult, ax: Axes) -> None:
    """Both forces over time."""
    ax.plot(
        result.t, result.recording.force_n, lw=1.6, color=COLOURS["measured"], alpha=0.6, label="measured"
    )
    ax.plot(
        result.t,
        np.linalg.norm(result.force_n, axis=1),
        lw=0.7,
        color=colour_of(result.renderer),
        label=result.renderer,
    )
    counted = result.contact if result.contact.any() else np.ones_like(result.contact)
    most = max(result.recording.force_n[counted].max(), np.linalg.norm(result.force_n, axis=1).max())
    ax.set(
        xlabel="time [s]",
        ylabel="force magnitude [N]",
        xlim=(result.t[counted][0], result.t[counted][-1]),
        ylim=(0, 1.05 * most),
        title=f"typically {mn(result.rmse_n)} apart, {100 * result.relative:.1f} %",
    )
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, ncols=2)


def place(result: ReplayResult, plotter: Plotter) -> None:
    """The object, each touch coloured by its rms error."""
    from palpate.show.scenery import add_dots, add_object

    add_object(plotter, result.model)
    places, errors = result.touches()
    add_dots(plotter, places, errors * 1e3, label=ERROR.label, colour_map=ERROR.colour_map)
