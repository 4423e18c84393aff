"""A replay: rendered against measured force along a recorded path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.render.force_error import said
from palpate.render.replay import ReplayResult
from palpate.show.page import file_words
from palpate.show.quantities import ERROR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.render.exact import ExactReplay

MEASURED, RENDERED = "#a8bccb", "#c1121f"


def lines(result: ReplayResult) -> list[str]:
    """What `print` says, with units."""
    return [
        f"{result.renderer}: rendered and measured force differ by {1e3 * result.rmse_n:.3g} mN, "
        f"{100 * result.relative:.3g} % of the measured {result.force_rms_n:.3g} N"
        + (f" (the sensor's noise: {1e3 * result.noise_n:.3g} mN)" if result.noise_n is not None else ""),
        f"  root mean square over {int(result.contact.sum())} samples in contact",
        *([f"  {words}"] if (words := said(result.error_figures)) else []),
        *(_solved(result.exact) if result.exact is not None else []),
    ]


def _solved(exact: ExactReplay) -> list[str]:
    """Law, solution and bound at the deepest of each place."""
    found = [
        f"  solved at {len(exact.places)} places, and the forces are by it",
        "    at the deepest [mm]   law [N]   solved [N]   the law may be off by [N]",
    ]
    for one in exact.places:
        depth, law, by, bound = 1e3 * one.depth_m[-1], one.law_n[-1], one.solved_n[-1], one.error_n[-1]
        found.append(f"    {depth:19.2f}{law:10.3f}{by:13.3f}{bound:12.3f}")
    if exact.unsolved:
        found.append(f"  {exact.unsolved} places keep the law: no equilibrium was found there")
    return found


def next_steps(result: ReplayResult) -> list[str]:
    """What to do with the difference."""
    recording, model = file_words(result.recording.path, "REC"), file_words(result.model.path, "MODEL")
    return [f"see what makes it: `palpate diagnose {recording} --model {model} --report PAGE.html`"]


def as_json(result: ReplayResult) -> dict[str, Any]:
    """The figures of `palpate replay --json`, keys with units."""
    figures = {
        "renderer": result.renderer,
        "samples": len(result.force_n),
        "contact_samples": int(result.contact.sum()),
        "rmse_n": result.rmse_n,
        "force_rms_n": result.force_rms_n,
        "relative_rmse": result.relative,
        "peak_force_n": float(np.linalg.norm(result.force_n, axis=1).max()),
        **result.error_figures,
    }
    if result.exact is not None:
        figures["exact"] = {"unsolved_places": result.exact.unsolved,
                            "places": [one.as_json() for one in result.exact.places]}  # fmt: skip
    return figures if result.noise_n is None else {**figures, "noise_n": result.noise_n}


def draw(result: ReplayResult, ax: Axes) -> None:
    """Both forces over time."""
    ax.plot(result.t, result.recording.force_n, lw=1.6, color=MEASURED, label="measured")
    ax.plot(result.t, np.linalg.norm(result.force_n, axis=1), lw=0.7, color=RENDERED, label=result.renderer)
    counted = result.contact if result.contact.any() else np.ones_like(result.contact)
    most = max(result.recording.force_n[counted].max(), np.linalg.norm(result.force_n, axis=1).max())
    ax.set(
        xlabel="time [s]",
        ylabel="force magnitude [N]",
        xlim=(result.t[counted][0], result.t[counted][-1]),
        ylim=(0, 1.05 * most),
        title=f"typically {1e3 * result.rmse_n:.0f} mN apart, {100 * result.relative:.1f} %",
    )
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, ncols=2)


def place(result: ReplayResult, plotter: Plotter) -> None:
    """The object, each touch coloured by its rms error."""
    from palpate.show.scenery import add_dots, add_object

    add_object(plotter, result.model)
    places, errors = result.touches()
    add_dots(plotter, places, errors * 1e3, label=ERROR.label, colour_map=ERROR.colour_map)
