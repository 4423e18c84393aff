"""What `--apply` is worth: the improved model against the plain one on presses that neither has seen.

Each recording is cut in free air: what comes before is reconstructed and diagnosed, what comes after is
replayed through the renderer with both models. Beside the errors stands what a tick of the replay costs.
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table
from mechanics.errors import RecordingError
from mechanics.model import Model, read_model, write_model
from mechanics.recording import Recording, read_recording

SUMMARY = "the improved model against the plain one, replayed on presses that neither has seen"
QUIET_S = 0.2
QUIET_N = 0.05


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recordings and where they are cut."""
    parser.add_argument("recordings", nargs="+", metavar="REC", help="recordings: .csv, .csv.gz or .toml")
    parser.add_argument("--share", type=float, default=0.7, help="of phase II that is fitted")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Diagnose the first part of each, replay the rest, print the table."""
    rows = [one(Path(path), arguments.share) for path in arguments.recordings]
    print(table(
        ["recording", "named", "applied", "plain model (N rms)", "improved", "of", "us a tick: plain",
         "improved"],
        [[r["recording"], ", ".join(r["named"]) or "-", ", ".join(r["applied"]) or "-",
          f"{r['plain_n']:.3f}", f"{r['improved_n']:.3f}", f"{r['force_n']:.2f}",
          f"{r['plain_us']:.0f}", f"{r['improved_us']:.0f}"] for r in rows]))  # fmt: skip
    return {"recordings": rows}


def one(path: Path, share: float) -> dict[str, Any]:
    """One recording's row."""
    from diagnose.apply import improved
    from diagnose.pipeline import diagnose
    from reconstruct.pipeline import ReconstructOptions, reconstruct
    from render.replay import contact_samples

    recording = read_recording(path)
    at = cut_at(recording, share)
    first = part_of(recording, slice(0, at))
    plain = reconstruct(first, ReconstructOptions())
    result = diagnose(first, plain)
    better, applied = improved(plain, result)
    counted = contact_samples(recording, plain)
    counted[:at] = False
    row: dict[str, Any] = {"recording": path.name.split(".")[0], "named": list(result.effects),
                           "applied": applied}  # fmt: skip
    for name, model in (("plain", plain), ("improved", better)):
        error, force, cost = _replayed(model, recording, counted)
        row |= {f"{name}_n": error, f"{name}_us": cost, "force_n": force}
    return row


def _replayed(model: Model, recording: Recording, counted: np.ndarray) -> tuple[float, float, float]:
    """(N rms, N rms of the measured force, us a tick) as `palpate replay` of the written model gives them."""
    from render.fem import FemRenderer
    from render.replay import replay_error, replay_recording

    with tempfile.TemporaryDirectory() as folder:
        write_model(Path(folder) / "model", model)
        again = read_model(Path(folder) / "model")
        renderer = FemRenderer(again)
        replay_recording(renderer, part_of(recording, slice(0, 10)))
        clock = time.process_time()
        forces = replay_recording(renderer, recording)
        cost = (time.process_time() - clock) / len(recording.t)
        error = replay_error(recording, again, forces, counted)
    return error.rmse_n, error.force_rms_n, 1e6 * cost


def cut_at(recording: Recording, share: float) -> int:
    """The sample, near `share` of phase II, around which nothing is touched. Raises RecordingError."""
    begin = recording.boundary_phase[1] if recording.boundary_phase else recording.t[0]
    wanted = begin + share * (recording.t[-1] - begin)
    width = max(3, round(QUIET_S * recording.sample_rate_hz))
    force = np.linalg.norm(recording.force_on_tool, axis=1)
    smooth = np.convolve(force, np.ones(width) / width, mode="same")
    quiet = np.flatnonzero((smooth < np.median(smooth[: 5 * width]) + QUIET_N) & (recording.t > wanted))
    if len(quiet) == 0:
        raise RecordingError(f"{recording.name}: no pause after {wanted:.0f} s; choose another --share")
    return int(quiet[0])


def part_of(recording: Recording, rows: slice) -> Recording:
    """The recording's samples `rows`."""
    turned = recording.quaternion
    return dataclasses.replace(
        recording, t=recording.t[rows], position=recording.position[rows],
        force_on_tool=recording.force_on_tool[rows], quaternion=None if turned is None else turned[rows],
        sha256="",
    )  # fmt: skip
