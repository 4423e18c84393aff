"""What `--apply` is worth on presses that it has not seen: a recording is cut in free air, what comes before
is reconstructed and diagnosed, what comes after is replayed.

Beside the diagnosed effects stand those of the recording's [truth], so that the law itself is tried.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from palpate.diagnosis.apply import corrected, improved, with_effects, with_replayed_modulus
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.effects.registry import effect
from palpate.mechanics.errors import RecordingError
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct
from palpate.reconstruction.presses_on_model import presses_on
from palpate.render.fem.renderer import FemRenderer
from palpate.render.replay import replay_recording, rms_n

QUIET_S = 0.2
QUIET_N = 0.05
LABORATORY = "palpate virtual laboratory"


def one(path: Path, share: float, work: Path) -> dict[str, Any]:
    """One recording's row; kept in `work`, which also keeps the models."""
    name = path.name.split(".")[0]
    kept = work / f"{name}.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    recording = read_recording(path)
    at = cut_at(recording, share)
    first = part_of(recording, slice(0, at))
    folder = work / name
    if not (folder / "model.toml").exists():
        write_model(folder, reconstruct(first, ReconstructOptions()))
    plain = read_model(folder)
    result = diagnose(first, plain)
    better, applied = improved(plain, result)
    counted = presses_on(recording, plain).touching(recording.t)
    before, after = counted.copy(), counted.copy()
    before[at:], after[:at] = False, False
    row: dict[str, Any] = {
        "recording": name,
        "truth": list((recording.truth or {}).get("effects", [])),
        "named": list(result.effects),
        "candidates": list(result.candidates),
        "applied": applied,
        "noise_n": result.noise_n,
        "held_out_samples": int(after.sum()),
    }
    ideal = plain.with_material(dent_law="linear").replaced(effects={})
    row["ideal_n"] = replayed(ideal, recording, after, fit=before)
    better = with_replayed_modulus(better.replaced(path=folder), corrected(first, result))
    row["improved_n"] = replayed(better, recording, after)
    true = {n: k for n, k in truth_effects(recording).items() if effect(n).rendered}
    if true:
        law = "neo-hookean" if "finite_strain" in true else "linear"
        stated = plain.with_modulus((recording.truth or {})["young_modulus_pa"]).with_material(dent_law=law)
        stated = stated.replaced(effects={})
        model = with_effects(stated, true).replaced(path=folder)
        row["truth_n"] = replayed(model, recording, after, fit=before)
        alone = {n: k for n, k in true.items() if n != "finite_strain"}
        if alone and law == "neo-hookean":
            row["finite_strain_alone_n"] = replayed(stated, recording, after, fit=before)
    with atomic_file(kept) as temporary:
        temporary.write_text(json.dumps(row, indent=1), encoding="utf-8")
    return row


def corrected_again(path: Path, work: Path) -> dict[str, Any]:
    """What a recording's fast diagnosis names, and what is named once it is corrected; kept in `work`."""
    name = path.name.split(".")[0]
    kept = work / f"{name}-corrected.json"
    if kept.exists():
        return json.loads(kept.read_text(encoding="utf-8"))
    recording = read_recording(path)
    folder = work / f"{name}-whole"
    if not (folder / "model.toml").exists():
        write_model(folder, reconstruct(recording, ReconstructOptions()))
    model = read_model(folder)
    first = diagnose(recording, model, DiagnoseOptions(fast=True))
    second = diagnose(corrected(recording, first), model, DiagnoseOptions(fast=True))
    row = {
        "recording": name,
        "truth": list((recording.truth or {}).get("effects", [])),
        "noise_n": first.noise_n,
    }
    for when, result in (("before", first), ("after", second)):
        row[f"named_{when}"] = list(result.effects)
        row[f"candidates_{when}"] = list(result.candidates)
        row[f"kind_{when}"] = result.kind
        row[f"gap_{when}_n"] = result.gap_before_n
    with atomic_file(kept) as temporary:
        temporary.write_text(json.dumps(row, indent=1), encoding="utf-8")
    return row


def replayed(
    model: Model, recording: Recording, counted: np.ndarray, *, fit: np.ndarray | None = None
) -> float:
    """N rms over the counted samples, as the renderer replays the path. fit: samples that the modulus is
    fitted to first; None takes the model's."""
    renderer = FemRenderer(model)
    for _ in range(0 if fit is None else 3):
        forces = replay_recording(renderer, recording)[fit]
        scale = (forces * recording.force_on_tool[fit]).sum() / (forces**2).sum()
        renderer = renderer.with_modulus(renderer.model.material.young_modulus_pa * scale)
    return rms_n((replay_recording(renderer, recording) - recording.force_on_tool)[counted])


def truth_effects(recording: Recording) -> dict[str, dict[str, Any]]:
    """Effects of [truth] with their parameters, SI, device frame (they are stated in the object's)."""
    truth = recording.truth or {}
    turn = np.array(truth.get("device_from_object_rotation", np.eye(3)))
    shift = 1e-3 * np.array(truth.get("device_from_object_shift_mm", np.zeros(3)))
    found: dict[str, dict[str, Any]] = {}
    stated = truth.get("parameters", {})
    for name in dict.fromkeys((*truth.get("effects", ()), *truth.get("strengths", {}), *stated)):
        keys = dict(stated.get(name, {}))
        for key in [k for k in keys if k.endswith("_mm")]:
            keys[key[:-3] + "_m"] = (1e-3 * np.array(keys.pop(key))).tolist()
        if "centre_m" in keys:
            keys["centre_m"] = (turn @ keys["centre_m"] + shift).tolist()
        if "direction" in keys:
            keys["direction"] = (turn @ keys["direction"]).tolist()
        if name == "adhesion" and truth.get("simulator") == LABORATORY:
            keys["inside"] = 1.0  # there the pull holds wherever the tip is on its way out
        found[name] = keys
    return found


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
