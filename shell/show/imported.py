"""What was understood of a table: its columns in lines, and the recording as a recording is shown."""

from __future__ import annotations

import numpy as np

from palpate.importing.imported import Imported
from palpate.show import story as say

SHOWN_AS = "recording"


def story(result: Imported) -> say.Story:
    """What the columns were taken for."""
    recording = result.understood.recording
    size = " x ".join(f"{v:.3g}" for v in 1e3 * np.ptp(recording.position, axis=0))
    greatest = float(np.linalg.norm(recording.force_on_tool, axis=1).max())
    how = "quasi-static points" if result.understood.quasi_static else f"{np.ptp(recording.t):.4g} s"
    yield say.Headline(
        f"{len(recording.t)} samples, {how}; path within {size} mm; force up to {greatest:.4g} N"
    )
    for said in (*result.understood.columns.values(), *result.understood.notes):
        yield say.Detail(str(said))


KEYS: tuple[say.Key, ...] = (
    ("samples", lambda result: len(result.recording.t)),
    ("duration_s", lambda result: np.ptp(result.recording.t)),
    "sample_rate_hz=recording.sample_rate_hz",
    "quasi_static=understood.quasi_static",
    (
        "columns",
        lambda result: {role: str(c).partition(" = ")[2] for role, c in result.understood.columns.items()},
    ),
    "notes=understood.notes",
)
