"""A recorded tip path through a renderer, headless: the same bits from every run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mechanics.errors import OptionError
from mechanics.files import atomic_file
from mechanics.model import Model
from mechanics.progress import Progress, silent
from mechanics.recording import Recording
from render.base import Renderer
from render.scene import TouchScene, scene_of

_CHUNK = 4000
_AROUND_S = 0.05  # of a contact that still counts
_QUIET_S = 0.05  # shorter pushes are noise


def replay(
    touched: Renderer | TouchScene,
    t: np.ndarray,
    positions: np.ndarray,
    *,
    tip_radius_m: float | None = None,
    progress: Progress = silent,
) -> np.ndarray:
    """Force on the tool (n, 3) N for a path of one tip: t (n,) s increasing, positions (n, 3) m of its
    centre.

    touched: a scene, or a renderer, which stands on its model's support. The tip starts in air: one that
    begins inside the object is not touched until it has come out. tip_radius_m: None takes the model's.
    Bit-identical from run to run. Raises OptionError where the shapes disagree.
    """
    scene = scene_of(touched)
    t = np.ascontiguousarray(t, dtype=float)
    positions = np.array(positions, dtype=float)
    if t.ndim != 1 or positions.shape != (len(t), 3):
        raise OptionError(f"a path needs t (n,) and positions (n, 3); got {t.shape} and {positions.shape}")
    forces = np.zeros_like(positions)
    state = scene.start(None if tip_radius_m is None else [tip_radius_m])
    steps = np.diff(t, prepend=t[0] - 1e-3) if len(t) else t
    for first in range(0, len(t), _CHUNK):
        part = slice(first, first + _CHUNK)
        forces[part] = scene.follow(state, positions[part, None], steps[part])[:, 0]
        progress("replay", min(first + _CHUNK, len(t)) / len(t))
    return forces


def replay_recording(
    touched: Renderer | TouchScene, recording: Recording, progress: Progress = silent
) -> np.ndarray:
    """`replay` of a recording's path with the recording's tip."""
    return replay(
        touched, recording.t, recording.position, tip_radius_m=recording.tip_radius_m, progress=progress
    )


def write_forces(path: Path | str, t: np.ndarray, forces: np.ndarray) -> None:
    """Write `t,fx,fy,fz`: s, and N on the tool."""
    with atomic_file(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        table = np.column_stack([t, forces])
        np.savetxt(file, table, fmt="%.10g", delimiter=",", header="t,fx,fy,fz", comments="")


def rms_n(forces: np.ndarray) -> float:
    """Root-mean-square length of force vectors (n, 3), N; NaN for none."""
    return float(np.sqrt((forces**2).sum(axis=1).mean())) if len(forces) else float("nan")


@dataclass(frozen=True)
class ReplayError:
    """How far replayed forces are from measured ones over the contact samples; N, vectors.

    contact: (n,) bool, the samples that count. rmse_n; force_rms_n: of the measured force; relative: their
    ratio.
    """

    rmse_n: float
    force_rms_n: float
    relative: float
    contact: np.ndarray


def replay_error(
    recording: Recording, model: Model, forces: np.ndarray, contact: np.ndarray | None = None
) -> ReplayError:
    """Compare forces (n, 3) N on the tool with the recording's over its contact samples.

    contact: (n,) bool where the caller knows them; None takes `contact_samples`.
    """
    contact = contact_samples(recording, model) if contact is None else np.asarray(contact, dtype=bool)
    error = rms_n(forces[contact] - recording.force_on_tool[contact])
    size = rms_n(recording.force_on_tool[contact])
    return ReplayError(error, size, error / size if size > 0 else float("nan"), contact)


def contact_samples(recording: Recording, model: Model) -> np.ndarray:
    """(n,) bool: phase II, from first touch to its loss, and up to 50 ms before and after.

    Touch shows in the force, averaged over 20 ms, less its median in the air: above five times its spread
    there. Phase I never counts; where the recording does not state it, it ends at the model's first
    palpation.
    """
    t, force = recording.t, recording.force_on_tool
    width = max(1, round(0.02 * recording.sample_rate_hz))
    smooth = np.apply_along_axis(lambda c: np.convolve(c, np.ones(width) / width, mode="same"), 0, force)
    start = _phase_two(recording, model)
    later = t > start
    if not later.any():
        return later
    size = np.linalg.norm(smooth, axis=1)
    quiet = later & (size <= np.quantile(size[later], 0.3))
    centre = np.median(smooth[quiet], axis=0)
    size = np.linalg.norm(smooth - centre, axis=1)
    noise = 1.4826 * np.median(size[quiet]) + 1e-4
    pressed = later & (size > 5 * noise)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], pressed.astype(int), [0]])))
    contact = np.zeros(len(t), dtype=bool)
    for first, last in zip(edges[::2], edges[1::2] - 1, strict=True):
        if t[last] - t[first] >= _QUIET_S:
            low, high = np.searchsorted(t, [t[first] - _AROUND_S, t[last] + _AROUND_S])
            contact[low:high] = True
    return contact & later


def _phase_two(recording: Recording, model: Model) -> float:
    own = model.provenance.get("recording_sha256") == recording.sha256
    onsets = [p.t_onset for p in model.palpations if np.isfinite(p.t_onset)]
    if own and onsets:
        return min(onsets) - 2 * _AROUND_S
    # contact may outlast the stated end of phase I by 0.1 s
    return recording.boundary_phase[1] + 0.1 if recording.boundary_phase else float(recording.t[0])
