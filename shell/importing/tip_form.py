"""The form of a tip that nobody stated: a sphere, unless what it pressed speaks against one; then asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from palpate.diagnosis.specimen.baseline import form_scores
from palpate.diagnosis.specimen.bench import MachineCycle
from palpate.importing.meaning import MOST_ODDS, Unclear, best
from palpate.mechanics.contact.tip import POINTED, WORDS, other_tip
from palpate.mechanics.errors import ContactError, RecordingError
from palpate.mechanics.plausible import USUAL_POISSON_RATIO
from palpate.mechanics.recording.recording import Recording
from palpate.reconstruction.geometry.stated import GeometryOptions, nowhere, stated_geometry
from palpate.reconstruction.steps.s3_contacts.contacts import explore
from palpate.reconstruction.steps.s3_contacts.quasi_static import is_points
from palpate.reconstruction.steps.s3_contacts.sliding_presses import FLAT
from palpate.words import listed

_PRESSES = 4


def sphere_or_ask(
    curves: Sequence[MachineCycle], radius_m: float, poisson_ratio: float | None, stiffened: bool = False
) -> float:
    """The odds for a sphere. stiffened: what is pressed raises the power of the force itself, as a thin layer
    does, so no cone is thought of. Raises Unclear where the curves speak against a sphere."""
    scores = form_scores(curves, radius_m, poisson_ratio or USUAL_POISSON_RATIO)
    forms = [form for form in scores if not (stiffened and form in POINTED)]
    reading = best({(k,): scores[form] for k, form in enumerate(forms)})
    if forms[reading.value[0]] == "sphere" and reading.sure:
        return reading.odds
    other = max((f for f in forms if f != "sphere"), key=lambda f: scores[f])
    against = float(np.exp(min(scores[other] - scores["sphere"], np.log(MOST_ODDS))))
    named = POINTED if other == "cone" else (other,)
    either = listed((WORDS[form] for form in named), "or")
    weighed = f"odds against a sphere {against:.2g} to 1"
    if against < 1:
        weighed = f"as likely as a sphere on a machine that yields: {against:.2g} to 1"
    raise Unclear(
        f"the form of the tip is in no file, and the force grows as {either} gives it ({weighed})",
        "tip",
        (*named, "sphere"),
    )


def with_tip(recording: Recording, form: str) -> Recording:
    """With its tip's form stated. Raises RecordingError for one that no recording has."""
    if form != "sphere":
        raise RecordingError(
            other_tip(
                form,
                "--tip",
                str(recording.path or "FILE"),
                recording.tip_radius_m,
                own=recording.path is not None,
            )
        )
    held = dict(recording.description)
    return replace(recording, description={**held, "tool": {**held.get("tool", {}), "tip": form}})


def ask_of_presses(recording: Recording, geometry: GeometryOptions) -> None:
    """Raise Unclear where presses of something flat speak against the sphere that was assumed; elsewhere the
    object's own shape has a part in how the force grows."""
    known = stated_geometry(recording, geometry)
    if not (known.kind in FLAT and recording.tip_assumed) or is_points(recording):
        return
    try:
        found = explore(recording, boundary=nowhere(recording), unbroken=True).presses
    except ContactError:
        return  # reconstruction says what is wrong
    parts = found.parts[:: max(1, len(found) // _PRESSES)]
    curves = [MachineCycle(found.t[part], found.depth[part], found.push[part]) for part in parts]
    try:
        sphere_or_ask(curves, recording.tip_radius_m, recording.poisson_ratio, not known.half_space)
    except ContactError:
        return
