"""Rerun's .rrd: object, tip and force in space, and force, residual and depth as curves, over the time `t`.

object (a mesh), tip (a ball of the tip's radius), tip/measured and tip/rendered (arrows, 10 mm a newton),
force/measured, force/rendered and residual (x, y, z, N on the tool), depth (m). Device frame, metres.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palpate.exporting.recorded import Recorded
from palpate.mechanics.progress import Progress, silent

ARROW_M_PER_N = 0.01
SPACE_HZ = 100.0
"""Of what is drawn in space; curves have every sample."""


def write(path: Path, told: Recorded, progress: Progress = silent) -> tuple[str, ...]:
    """Write the file; what it does not say. Raises ImportError where rerun-sdk is not installed."""
    import rerun as rr

    recording = told.recording
    stream = rr.RecordingStream("palpate", recording_id=recording.content[:32], send_properties=False)
    stream.save(path)
    stream.send_recording_name(recording.name)
    stream.log("/", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    if told.model is not None:
        mesh = told.model.mesh.linear()
        shape = rr.Mesh3D(vertex_positions=mesh.points, triangle_indices=mesh.touchable_surface)
        stream.log("object", shape, static=True)
    t, every = recording.t, max(1, round(recording.sample_rate_hz / SPACE_HZ))
    moments, tip = t[::every], recording.position[::every]
    progress("tip", 0.3)
    radii = np.full(len(moments), recording.tip_radius_m)
    _send(stream, "tip", moments, rr.Points3D.columns(positions=tip, radii=radii))
    forces = {"measured": recording.force_on_tool}
    if told.rendered_n is not None:
        forces["rendered"] = told.rendered_n
    for name, force in forces.items():
        progress(name, 0.6)
        arrows = rr.Arrows3D.columns(vectors=ARROW_M_PER_N * force[::every], origins=tip)
        _send(stream, f"tip/{name}", moments, arrows)
        _send(stream, f"force/{name}", t, _three(rr, force))
    if told.residual_n is not None:
        _send(stream, "residual", t, _three(rr, told.residual_n))
    if told.depth_m is not None:
        _send(stream, "depth", t, rr.Scalars.columns(scalars=told.depth_m))
    stream.flush()
    stream.disconnect()
    rarer = (f"tip and arrows {recording.sample_rate_hz / every:.0f} times a second, curves at every sample",)
    return (*told.notes, *(rarer if every > 1 else ()))


def _three(rr: Any, values: np.ndarray) -> Any:
    """(n, 3) as three curves."""
    return rr.Scalars.columns(scalars=values.ravel()).partition(np.full(len(values), 3))


def _send(stream: Any, entity: str, t: np.ndarray, columns: Any) -> None:
    import rerun as rr

    moments = np.round(1e9 * t).astype("timedelta64[ns]")  # of seconds it cuts off what is below 1 ns
    rr.send_columns(entity, [rr.TimeColumn("t", duration=moments)], columns, recording=stream, strict=True)
