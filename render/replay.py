"""A recorded tip path through a renderer, headless: the same bits from every run."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.errors import OptionError
from palpate.mechanics.model.model import Model
from palpate.mechanics.presses.table import LEAD_S, Presses
from palpate.mechanics.progress import Progress, Remaining, silent
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.segments import runs
from palpate.mechanics.result import Result
from palpate.render.base import Renderer
from palpate.render.force_error import error_figures, force_errors
from palpate.render.scene import TouchScene, scene_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from palpate.render.exact import ExactReplay

FORCES = Kind("a file of palpate replay", (b"t,fx,fy,fz",))
_CHUNK, _TOLD, _WATCHED = 4000, 100, 10


def replay(
    touched: Renderer | TouchScene,
    t: np.ndarray,
    positions: np.ndarray,
    *,
    tip_radius_m: float | None = None,
    progress: Progress = silent,
    unsettled: Callable[[int], None] | None = None,
    checked: bool = True,
    enough: Callable[[np.ndarray], bool] | None = None,
) -> np.ndarray:
    """Force on the tool (n, 3) N for a path of one tip: t (n,) s increasing, positions (n, 3) m of its
    centre.

    touched: a scene, or a renderer, which stands on its model's support. tip_radius_m: None takes the
    model's. unsettled: told how many samples' force did not settle, and hold the one before. Bit-identical
    from run to run. Raises OptionError where the shapes disagree, and, if checked, where the path starts in
    the object: a tip that does feels nothing until it has come out.
    enough: given the forces (k, 3) N so far, every few samples; where it is true the path ends, and those are
    returned.
    """
    scene = scene_of(touched)
    t = np.ascontiguousarray(t, dtype=float)
    positions = np.array(positions, dtype=float)
    if t.ndim != 1 or positions.shape != (len(t), 3):
        raise OptionError(f"a path needs t (n,) and positions (n, 3); got {t.shape} and {positions.shape}")
    radius = scene.model.tool.tip_radius_m if tip_radius_m is None else tip_radius_m
    if checked:
        check_path(scene, t, positions, radius)
    forces = np.zeros_like(positions)
    state = scene.start([radius])
    steps = np.diff(t, prepend=t[0] - 1e-3) if len(t) else t
    chunk = _CHUNK if enough is None else _WATCHED
    for first in range(0, len(t), chunk):
        part = slice(first, first + chunk)
        forces[part] = scene.follow(state, positions[part, None], steps[part])[:, 0]
        progress("replay", min(first + chunk, len(t)) / len(t))
        if enough is not None and enough(forces[: first + chunk]):
            return forces[: first + chunk]
    if unsettled is not None:
        unsettled(int(state.touch.unsettled[0]))
    return forces


def replay_recording(
    touched: Renderer | TouchScene,
    recording: Recording,
    progress: Progress = silent,
    unsettled: Callable[[int], None] | None = None,
    *,
    checked: bool = True,
) -> np.ndarray:
    """`replay` of a recording's path with the recording's tip."""
    path, radius = recording.position, recording.tip_radius_m
    return replay(
        touched, recording.t, path, tip_radius_m=radius, progress=progress, unsettled=unsettled,
        checked=checked,
    )  # fmt: skip


def check_path(scene: TouchScene, t: np.ndarray, positions: np.ndarray, radius_m: float) -> None:
    """Raise OptionError where the path (n, 3) m of a tip's centre starts in the object."""
    read = np.flatnonzero(np.isfinite(positions).all(axis=1))
    if not len(read) or scene.is_free(positions[read[0]], radius_m):
        return
    out = next((k for k in read if scene.is_free(positions[k], radius_m)), None)
    cure = (
        "and never leaves it: are path and model in one frame, and both in metres?"
        if out is None
        else f"where no press is felt: it is free at t = {t[out]:.6g} s, cut the rows before"
    )
    raise OptionError(
        f"the path starts at {np.round(positions[read[0]], 6).tolist()} m (t = {t[read[0]]:.6g} s), where a "
        f"tip of radius {radius_m:g} m is in the object, {cure}"
    )


def replay_touches(
    touched: Renderer | TouchScene,
    recording: Recording,
    presses: Presses,
    chosen: np.ndarray,
    progress: Progress = silent,
    failed: Callable[[int, OptionError], None] | None = None,
) -> np.ndarray:
    """`replay` over the chosen (p,) presses of a recording alone, each from shortly before its first touch to
    shortly after its loss, and by itself: (n, 3) N at the recording's rows, zeros elsewhere.

    failed(press, error): called where a simulator finds no answer, whose press then has zeros; None: raised.
    """
    scene, t = scene_of(touched), recording.t
    forces = np.zeros((len(t), 3))
    numbers = np.flatnonzero(chosen).tolist()
    parts = [rows_of_touch(t, presses, p) for p in numbers]
    whole, done, left = sum(part.stop - part.start for part in parts), 0, Remaining()
    left.tell(0.0)
    if parts:
        progress(f"press 1 of {len(parts)}", 0.0)
    for k, own in enumerate(parts, 1):
        for first in range(own.start, own.stop, _TOLD):
            rows = slice(first, min(first + _TOLD, own.stop))
            if first == own.start:
                state = scene.start([recording.tip_radius_m])
            steps = np.diff(t[rows], prepend=t[rows.start - 1] if rows.start else t[0] - 1e-3)
            try:
                forces[rows] = scene.follow(state, np.array(recording.position[rows, None]), steps)[:, 0]
            except OptionError as error:
                if failed is None:
                    raise
                failed(numbers[k - 1], error)
                forces[own] = 0.0
                done += own.stop - first
                break
            done += rows.stop - rows.start
            left.tell(done / whole)
            words = ", ".join(word for word in (f"press {k} of {len(parts)}", left.words()) if word)
            progress(words, done / whole)
    return forces


def rows_of_touch(t: np.ndarray, presses: Presses, number: int) -> slice:
    """Rows of t (n,) s from shortly before a press's first touch to shortly after its loss."""
    before = presses.end_s[number - 1] if number else -np.inf
    begun = max(presses.onset_s[number] - LEAD_S, before)
    return slice(*np.searchsorted(t, [begun, presses.end_s[number] + LEAD_S]))


def write_forces(path: Path | str, t: np.ndarray, forces: np.ndarray) -> None:
    """Write `t,fx,fy,fz`: s, and N on the tool."""
    with atomic_file(path, FORCES) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        table = np.column_stack([t, forces])
        np.savetxt(file, table, fmt="%.10g", delimiter=",", header="t,fx,fy,fz", comments="")


def rms_n(forces: np.ndarray) -> float:
    """Root-mean-square length of force vectors (n, 3), N; NaN for none."""
    return float(np.sqrt((forces**2).sum(axis=1).mean())) if len(forces) else float("nan")


@dataclass(frozen=True, eq=False)
class ReplayError:
    """How far replayed forces are from measured ones over the contact samples; N, vectors.

    contact: (n,) bool, the samples that count: phase II, from first touch to its loss and 50 ms around.
    rmse_n: N, rms length of the error over them; force_rms_n: of the measured force; relative: their ratio.
    """

    rmse_n: float
    force_rms_n: float
    relative: float
    contact: np.ndarray


def replay_error(recording: Recording, presses: Presses, forces: np.ndarray) -> ReplayError:
    """Compare forces (n, 3) N on the tool with the recording's over the contact samples of its presses."""
    contact = presses.touching(recording.t)
    error = rms_n(forces[contact] - recording.force_on_tool[contact])
    size = rms_n(recording.force_on_tool[contact])
    return ReplayError(error, size, error / size if size > 0 else float("nan"), contact)


@dataclass(frozen=True, eq=False, repr=False)
class ReplayResult(Result, ReplayError):
    """Forces of a renderer along a recorded path, against those measured.

    t: (n,) s. force_n: (n, 3) N rendered, on the tool, device frame. used: the renderer itself. exact: the
    touched places as they were solved, where the forces are by that. unsettled: samples whose force did not
    settle, and that hold the one before. `plot`: both forces over time. `show`:
    the object, each touch coloured by its rms error.
    """

    recording: Recording
    model: Model
    renderer: str
    t: np.ndarray
    force_n: np.ndarray
    used: Renderer | None = None
    exact: ExactReplay | None = None
    unsettled: int = 0

    @property
    def error_n(self) -> np.ndarray:
        """(n, 3) N, rendered less measured force."""
        return self.force_n - self.recording.force_on_tool

    @property
    def noise_n(self) -> float | None:
        """N, rms length of the sensor's noise, where the recording states it."""
        noise = self.recording.force_noise_std_n
        return None if noise is None else float(noise * np.sqrt(3.0))

    @cached_property
    def error_figures(self) -> dict[str, float]:
        """What the rendered force may be off by, N rms over the contact samples: keys of render.force_error;
        {} where unknown."""
        if self.used is None or not self.contact.any():
            return {}
        felt = self.contact
        path, radius = self.recording.position[felt], self.recording.tip_radius_m
        return error_figures(force_errors(self.used, path, self.force_n[felt], radius))

    def save(self, path: Path | str) -> Path:
        """Write `t,fx,fy,fz` (s, and N on the tool) as `palpate replay` does."""
        write_forces(path, self.t, self.force_n)
        return Path(path)

    def touches(self) -> tuple[np.ndarray, np.ndarray]:
        """Places (k, 3) m where the tip met the object, and the rms error (k,) N of each touch."""
        size = np.linalg.norm(self.force_n, axis=1)
        places, errors = [], []
        for first, last in runs(self.contact):
            felt = np.flatnonzero(size[first:last] > 0)
            if len(felt):
                at = first + felt[0]
                normal = self.force_n[at] / size[at]
                places.append(self.recording.position[at] - self.recording.tip_radius_m * normal)
                errors.append(np.sqrt((self.error_n[first:last] ** 2).sum(axis=1).mean()))
        return np.array(places).reshape(-1, 3), np.array(errors)
