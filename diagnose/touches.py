"""The presses as a diagnosis weighs them: thinned to 100 Hz, from shortly before first touch to shortly after
its loss."""

from __future__ import annotations

import dataclasses

import numpy as np

from diagnose.leads import leads
from mechanics.errors import DiagnosisError
from mechanics.presses import LEAD_S, STEP_S, Presses

LEAST_PRESSES, LEAST_SITES = 6, 4
LEAST_S = 0.08
LEAST_ROWS = 12


def touches_of(presses: Presses, *, step_s: float = STEP_S) -> Presses:
    """The thinned view of a table; its columns hold `lead`, the side of the tip in a play (diagnose.leads).

    Raises DiagnosisError with fewer than 6 presses or 4 sites: nothing can be held out.
    """
    if len(presses) < LEAST_PRESSES:
        raise DiagnosisError(
            f"the model has {len(presses)} palpations; a diagnosis holds sites out and needs at least "
            f"{LEAST_PRESSES}"
        )
    if not presses.sampled:
        raise DiagnosisError("the table of presses has no samples: reconstruct the recording again")
    lead = np.concatenate([leads(presses.t[part], presses.position[part]) for part in presses.parts])
    limit = np.append(presses.onset_s[1:] - LEAD_S, np.inf)
    seen = dataclasses.replace(presses, columns={"lead": lead})
    rows = (seen.t >= (seen.onset_s - LEAD_S)[seen.press]) & (
        seen.t < np.minimum(seen.end_s + LEAD_S, limit)[seen.press]
    )
    seen = seen.where(rows).thinned(step_s)
    lasting = (seen.end_s - seen.onset_s >= LEAST_S) & (np.diff(seen.starts) >= LEAST_ROWS)
    if lasting.sum() < LEAST_PRESSES:
        raise DiagnosisError(
            f"only {lasting.sum()} palpations last 0.1 s or more; a diagnosis needs at least {LEAST_PRESSES}"
        )
    seen = seen.of(lasting)
    if seen.sites < LEAST_SITES:
        raise DiagnosisError(
            f"the palpations are at {seen.sites} places only; a diagnosis needs {LEAST_SITES} or more"
        )
    return seen
