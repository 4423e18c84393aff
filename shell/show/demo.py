"""The demo's report: what was touched, what was reconstructed, how its force compares, how the loop ran."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.demo import DemoResult
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.presses.table import MARGIN_S, Presses
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.steps.s6_one_d import low_passed
from palpate.render.surface.felt_surface import felt_surface
from palpate.servo.report import ServoReport
from palpate.show import story as say
from palpate.show.colours import COLOURS
from palpate.show.diagnosis.gaps import known
from palpate.show.diagnosis.words import verdict
from palpate.show.model import local, rms_by_press, usual_colourings, view_of_presses
from palpate.show.page import file_words, subplots
from palpate.show.quantities import ERROR, UNCERTAINTY
from palpate.show.reconstruction.exploration import force_over_time
from palpate.show.scenery import Colours, draw_object, draw_touched
from palpate.show.view3d import Colouring, Line, View
from palpate.words import begun, force_words, kpa, mn, share_words, spoken, sure_kpa

if TYPE_CHECKING:
    from matplotlib.figure import Figure


SHOWN_AS = "reconstruction"
_STAGES = {
    "reconstruct": "from the recording to the model",
    "precompute": "the compliance of every place",
    "replay": "the recorded path once more",
    "feel at 1 kHz": "a simulated hand at 1000 forces a second",
    "diagnose": "what the simplest simulation leaves out",
}
SHOWN_PRESSES = 3
_STEP_S = 0.05
"""Between samples of one press of a diagnosis; what is longer lies between presses."""


def story(result: DemoResult) -> say.Story:
    """What was made, how its force compares, how the loop ran, what a simpler simulation leaves out."""
    yield say.Title(f"Palpate: {result.recording.object_name}, touched and felt", pictures="beside")
    model, servo = result.model, result.servo
    presses, modulus = f"{len(model.presses)} presses", model.material.young_modulus_pa
    off, touches = force_words(result.replay_rmse_n), force_words(result.contact_force_rms_n)
    felt = f"a hand would have felt it at {servo.rate_hz:.0f} forces a second"
    yield say.Headline(f"{presses} became a model of {kpa(modulus)} (Young's modulus)", on=say.TEXT)
    feels = f"{presses} became a model that feels like the object"
    yield say.Headline(f"{feels}, typically {off} off in touches of {touches}", on=say.PAGE)
    yield say.TextLine(f"its force is typically {off} off, in touches of {touches}")
    missed = servo.missed_ticks
    of = f"{missed} forces were skipped"
    yield say.TextLine(f"{felt}: {of}, {servo.late_ticks} came late")
    if result.diagnosis is not None:
        yield say.TextLine(f"diagnosis: {verdict(result.diagnosis)}")
    sure_of = sure_kpa(model.material.young_modulus_ci95_pa, ".1f")
    yield say.Sentence(
        f"{_meaning(result)} The object's stiffness: a Young's modulus of {kpa(modulus, '.1f')} "
        f"({sure_of}{_truth(result)}). {begun(felt)}{f'; {of}' if missed else ', and none was skipped'}",
        on=say.PAGE,
    )
    where = file_words(model.path, "MODEL")
    yield say.Next([f"feel it: `palpate touch {where}`", "bring in your own recording: `palpate open FILE`"])
    yield say.Turned(
        lambda: view(result),
        say.Picture(
            lambda: object_figure(result),
            "Left: where the object was touched, and its glued base. Right: how uncertain its shape is.",
            name="object",
        ),
        model,
    )
    yield say.Section("How near is the rendered force to the measured one?", _presses(result))
    if result.diagnosis is not None:
        yield say.Section(
            "What would a simpler simulation leave out?", [say.Sentence(diagnosis_words(result))]
        )
    yield say.Section("What did the hand do?", [
        say.Picture(
            lambda: force_figure(result),
            "Force over time: first the base is traced, then the object is pressed.",
            name="force",
        )
    ])  # fmt: skip
    yield say.Section("How was it made?", _how(result))


def _presses(result: DemoResult) -> say.Story:
    yield say.Sentence("Three presses, from the lightest to the hardest")
    yield say.Pictures([
        say.Picture(partial(press_figure, result, i), f"Press {i + 1}.", name=f"press-{i + 1}")
        for i in spread_presses(result)
    ])  # fmt: skip


def _how(result: DemoResult) -> say.Story:
    surface = result.reconstruction.surface
    yield say.Sentence(f"Shape: {surface.method}, {surface.reason}")
    yield say.Rows(["the loop of 1000 forces a second", "against a simulated hand"], _loop(result.servo))
    if words := sent_words(result.servo):
        yield say.Sentence(words)
    rows = [[_STAGES.get(name, name), f"{s:.1f}"] for name, s in result.seconds.items()]
    yield say.Rows(["step", "time [s]"], rows)


_DIAGNOSIS = ("verdict", "noise_n", "gap_before_n", "gap_after_n", "gap_closed")
KEYS: tuple[say.Key, ...] = (
    "young_modulus_pa=model.material.young_modulus_pa",
    "young_modulus_ci95_pa=model.material.young_modulus_ci95_pa",
    "replay_rmse_n",
    "servo",
    "seconds",
    ("diagnosis", lambda result: diagnosis_json(result.diagnosis)),
)


def diagnosis_json(diagnosis: Diagnosis | None) -> dict[str, Any] | None:
    """The diagnosis's answer, by the keys of `palpate diagnose --json`; None where none was made."""
    if diagnosis is None:
        return None
    whole = diagnosis.as_json()
    return {key: whole[key] for key in _DIAGNOSIS}


def _loop(servo: ServoReport) -> list[list[str]]:
    """What the loop did, in words."""
    compute = servo.compute.as_json()
    return [
        ["forces given", f"{servo.ticks} in {servo.seconds:.1f} s"],
        ["skipped, since the machine was busy", str(servo.missed_ticks)],
        ["given late", str(servo.late_ticks)],
        ["to compute one force", f"{compute['median']:.0f} µs (median), {compute['max']:.0f} µs at most"],
        ["in contact", f"{100 * servo.contact_share:.0f} % of the time"],
        ["greatest force", f"{servo.peak_rendered_n:.2f} N rendered, {servo.peak_force_n:.2f} N sent"],
        ["energy given to the hand", f"{1e3 * servo.energy_given_back_j:.3f} mJ at most"],
    ]


def _meaning(result: DemoResult) -> str:
    noise = result.reconstruction.exploration.noise_n * np.sqrt(3.0)
    ratio = result.replay_rmse_n / noise
    compared = "as small as" if ratio < 1.1 else f"{ratio:.1f} times"
    return (
        f"That difference (the force vector, along the recorded path on the reconstructed shape) is "
        f"{compared} the sensor's own noise ({mn(noise)}), which is in it."
    )


def diagnosis_words(result: DemoResult) -> str:
    """What the diagnosis found, and which of the two simulations it is about."""
    found, law = result.diagnosis, result.model.material.dent_law
    assert found is not None
    there = _has(result)
    words = "The simplest simulation has small deformations and one stiffness. "
    if found.effects:
        words += f"It leaves out {spoken(found.effects)}"
        if found.gap_closed is not None:
            words += (
                f", which explains {share_words(found.gap_closed)} of what it is off beyond the sensor's "
                "noise, at places that it was not fitted to"
            )
        words += "."
    else:
        words += "Nothing was named that it leaves out."
    has = [name for name in found.effects if name in there]
    if has:
        words += f" The model that you feel has {spoken(has)} already: its {law} law stands for it."
    rest = [name for name in found.effects if name not in there]
    if rest:
        words += f" It does not have {spoken(rest)}: what to do about that is in the page of "
        words += f"`palpate diagnose {file_words(result.recording.path, 'REC')} --report PAGE.html`."
    if found.candidates:
        words += f" These touches cannot rule out {spoken(found.candidates, 'or')}."
    return words


def _has(result: DemoResult) -> set[str]:
    """Effects that the model has already."""
    return {known()} if result.model.material.dent_law != "linear" else set()


def sent_words(servo: ServoReport) -> str:
    """Why the device was sent another greatest force than was rendered, '' where it was not."""
    more = servo.peak_force_n - servo.peak_rendered_n
    if abs(more) < 0.01:
        return ""
    if more > 0:
        return (
            f"The {more:.2f} N more that were sent than rendered are damping: where a held sample would give "
            "the hand energy back, the passivity controller resists the motion. It took "
            f"{1e3 * servo.energy_damped_j:.1f} mJ in all."
        )
    return f"The {-more:.2f} N less that were sent than rendered were held back by the safety filter."


def _truth(result: DemoResult) -> str:
    truth = (result.recording.truth or {}).get("young_modulus_pa")
    return f"; the truth is {kpa(truth, '.1f')}" if truth else ""


def spread_presses(result: DemoResult) -> list[int]:
    """Presses spread over the peak force."""
    shown = low_passed(result.model.presses)
    push = _peaks(shown)
    return [
        int(i) for i in np.argsort(push)[np.linspace(0, len(push) - 1, SHOWN_PRESSES).round().astype(int)]
    ]


def _peaks(shown: Presses) -> list[float]:
    return [shown.push[shown.rows([i])].max() for i in range(len(shown))]


def press_figure(result: DemoResult, i: int) -> Figure:
    """Force of a press along the normal over depth, measured and rendered."""
    presses = result.model.presses
    shown = low_passed(presses)
    curves, smooth = presses.window(0.03, 0.03), shown.window(0.03, 0.03)
    figure, ax = subplots(1, 1, figsize=(4.4, 3))
    own = curves.rows([i])
    depth, at = smooth.depth[own] * 1e3, np.searchsorted(result.recording.t, curves.t[own])
    rendered = result.rendered_n[at] @ presses.normal[i]
    ax.plot(depth, curves.push[own], ".", ms=1, color=COLOURS["measured"], label="measured")
    ax.plot(depth, rendered, lw=1.5, color=COLOURS["fem"], label="rendered")
    ax.set(title=f"press {i + 1}", xlabel="depth [mm]", ylabel="force along the normal [N]")
    ax.set_ylim(top=1.05 * max(_peaks(shown)))
    ax.legend(loc="upper left", frameon=False, markerscale=8)
    return figure


def view(result: DemoResult) -> View:
    """The object; each press as measured, as rendered, and as the diagnosis's ideal simulation."""
    model, recording = result.model, result.recording
    shown = low_passed(model.presses).window(0.03, 0.03)
    at = _rows(recording, shown)
    logged = model.presses.window(MARGIN_S, MARGIN_S)
    each = rms_by_press(logged, (result.rendered_n - recording.force_on_tool)[_rows(recording, logged)])
    lines = [
        Line("measured", local(shown, shown.force), "measured"),
        Line("rendered", local(shown, result.rendered_n[at]), "fem"),
        *_simulated(result, shown.t),
    ]
    error = Colouring(
        ERROR,
        None,
        each,
        "Rendered less measured force, a vector, as logged (the sensor's noise is in it), root mean square "
        f"over each press; over all of them {mn(result.replay_rmse_n)}. Between presses what is near, paler "
        "where it was not touched.",
    )
    first, *others = usual_colourings(model)
    return view_of_presses(model, shown, [first, error, *others], lines, int(np.argmax(each)))


def _rows(recording: Recording, presses: Presses) -> np.ndarray:
    """Of the recording, at the rows of its presses."""
    return np.searchsorted(recording.t, presses.t).clip(0, len(recording.t) - 1)


def _simulated(result: DemoResult, t: np.ndarray) -> list[Line]:
    """The diagnosis's own simulations at times t (n,) s: the ideal one, and with what was found, where the
    model does not have all of that."""
    found = result.diagnosis
    if (
        found is None
        or found.forward is None
        or found.residual_before is None
        or found.residual_after is None
    ):
        return []
    touches = found.forward.touches
    following = np.searchsorted(touches.t, t).clip(1, len(touches.t) - 1)
    between = touches.t[following] - touches.t[following - 1] > _STEP_S
    lines = []
    for name, residual, kind in (
        ("ideal simulation (linear, small strain)", found.residual_before, "simplest"),
        ("simulation with what was found", found.residual_after, "found"),
    ):
        force = touches.local_force - residual
        seen = np.stack([np.interp(t, touches.t, axis, np.nan, np.nan) for axis in force.T], axis=1)
        lines.append(Line(name, np.where(between[:, None], np.nan, seen), kind, False))
    return lines if set(found.effects) - _has(result) else lines[:1]


def force_figure(result: DemoResult) -> Figure:
    """Force over time with the touches that were found."""
    figure, ax = subplots(1, 1, figsize=(9, 3))
    force_over_time(ax, result.reconstruction.exploration)
    return figure


def object_figure(result: DemoResult) -> Figure:
    """Where it was touched; how uncertain its shape is."""
    figure, axes = subplots(1, 2, figsize=(10, 4.2))
    draw_touched(axes[0], result.model)
    doubt = felt_surface(result.model).uncertainty_m
    draw_object(axes[1], result.model, Colours(doubt * UNCERTAINTY.scale, UNCERTAINTY))
    return figure
