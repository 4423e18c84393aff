"""What an instrument does to a recording, as a file that recordings name: [tool] calibration = "TOOL.toml".

The corrections are taken in the order in which the instrument made them, the last first: the force's delay,
its bias, its matrix; then the play between sensor and tip, and the bending of the tool.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from palpate.mechanics.disk.reading import read_toml
from palpate.mechanics.disk.schema import ANY, FileKey, Schema, check_table
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.disk.writing import Kind, atomic_file
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.plausible import TIP_RADIUS
from palpate.mechanics.recording.segments import delayed
from palpate.mechanics.recording.side_of_play import leads, play
from palpate.mechanics.result import Result

SCHEMA: Schema = {
    "calibration": ANY,
    "tool": {
        "tip_radius_m": dataclasses.replace(TIP_RADIUS, low=1e-6, required=False),  # an AFM's is so small
        "stiffness_n_per_m": FileKey(low=1.0, high=1e9, unit="N/m"),
        "play_m": FileKey(low=-0.01, high=0.01, unit="m"),
    },
    "sensor": {
        "matrix": ANY,
        "bias_n": FileKey(size=3, unit="N"),
        "delay_s": FileKey(low=-1.0, high=1.0, unit="s"),
        "force_noise_std_n": FileKey(low=0.0, high=10.0, unit="N"),
    },
    "interval": ANY,
}
TOOL = Kind("a tool's calibration", (b"[calibration]",))


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result):
    """What an instrument does to a recording. None where a value is not known: that reading is left as it is.

    tip_radius_m; stiffness_n_per_m of the tool between sensor and tip; play_m, positive where the tip lags
    behind the sensor, negative where the sensor lags; matrix (3, 3), read = matrix true; bias_n (3,);
    delay_s, by which the force reads late; force_noise_std_n an axis. interval: key -> [low, high] at 95 %.
    about: on what it was calibrated, and what that cannot tell. A recording names it: [tool] calibration =
    "TOOL.toml". `plot`: what the sensor's matrix makes of each axis. `show`: nothing, it has no
    place in space.
    """

    tip_radius_m: float | None = None
    stiffness_n_per_m: float | None = None
    play_m: float | None = None
    matrix: np.ndarray | None = None
    bias_n: np.ndarray | None = None
    delay_s: float | None = None
    force_noise_std_n: float | None = None
    interval: Mapping[str, Any] = field(default_factory=dict)
    about: Mapping[str, Any] = field(default_factory=dict)

    def as_ideal(
        self, t: np.ndarray, force: np.ndarray, position: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """(force on the tool (n, 3) N, position (n, 3) m) as an ideal instrument had read them at t (n,)
        s."""
        if self.delay_s:
            force = delayed([slice(None)], t, force, -self.delay_s)
        if self.bias_n is not None:
            force = force - self.bias_n
        if self.matrix is not None:
            force = force @ np.linalg.inv(self.matrix).T
        if self.play_m:
            position = _played(t, position, self.play_m)
        if self.stiffness_n_per_m is not None:
            position = position + force / self.stiffness_n_per_m
        return force, position

    def corrected(self, recording: Any) -> Any:
        """The `mechanics.recording.recording.Recording` as an ideal instrument had read it."""
        return recording.corrected(self)

    def save(self, path: Path | str) -> Path:
        """Write TOOL.toml; returns its path."""
        path = Path(path)
        if path.suffix != ".toml":
            raise RecordingError(f"'{path}' must end in .toml")
        with atomic_file(path, TOOL) as temporary:
            temporary.write_text(dump_toml(self.as_json()), encoding="utf-8")
        return path

    def as_json(self) -> dict[str, Any]:
        """What the TOML holds."""
        tool = {n: getattr(self, n) for n in ("tip_radius_m", "stiffness_n_per_m", "play_m")}
        sensor = {n: getattr(self, n) for n in ("matrix", "bias_n", "delay_s", "force_noise_std_n")}
        return {
            "calibration": dict(self.about),
            "tool": {n: v for n, v in tool.items() if v is not None},
            "sensor": {n: np.asarray(v).tolist() for n, v in sensor.items() if v is not None},
            "interval": dict(self.interval),
        }


def _played(t: np.ndarray, position: np.ndarray, width: float) -> np.ndarray:
    """(n, 3) m, where the tip is, from the readings (n, 3) and a play."""
    if width <= 0:
        # the hand moves the tip, and the reading follows once the play is taken up
        return position - 0.5 * width * leads(t, position)
    out = np.empty_like(position)
    play(np.array([0, len(position)]), np.ascontiguousarray(position), np.zeros((1, 3)), width, out)
    return out


def read_calibration(path: Path | str) -> Calibration:
    """Read TOOL.toml; raises RecordingError where it is missing or holds what no tool has."""
    path = Path(path)
    table = read_toml(path, RecordingError)
    check_table(table, SCHEMA, path, RecordingError, strict=False)
    tool, sensor = table.get("tool", {}), table.get("sensor", {})
    matrix = sensor.get("matrix")
    if matrix is not None:
        try:
            matrix = np.asarray(matrix, dtype=float)
            sound = matrix.shape == (3, 3) and np.linalg.cond(matrix) < 100
        except (TypeError, ValueError):
            sound = False
        if not sound:
            raise RecordingError(f"'{path}': [sensor] matrix must be 3 x 3 numbers that can be inverted")
    bias = sensor.get("bias_n")
    return Calibration(
        **{
            n: None if tool.get(n) is None else float(tool[n])
            for n in ("tip_radius_m", "stiffness_n_per_m", "play_m")
        },
        matrix=matrix,
        bias_n=None if bias is None else np.asarray(bias, dtype=float),
        delay_s=None if sensor.get("delay_s") is None else float(sensor["delay_s"]),
        force_noise_std_n=sensor.get("force_noise_std_n"),
        interval=table.get("interval", {}),
        about=table.get("calibration", {}),
    )
