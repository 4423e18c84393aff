"""Diagnosis on measured tissue: indentations of meat, a ramp and a hold, from a folder that is not shipped.

The set: github.com/SarahIaquinta/perineal_indentation (GPL-3.0), converted to CSVs with the columns t_s,
force_N, indent_mm, tool_gap_mm at 10 Hz. Every piece is another animal's, so each force is scaled to 1 N at
3 mm of its ramp, and the pieces become places on one slab. The indenter's shape is not stated; a sphere of
5 mm is taken. What can be judged: whether the hold's decay is called viscoelasticity, what its terms are, and
how well they tell a hold that no fit has seen from that piece's own ramp: there neither the piece's stiffness
nor the form of its depth law matters, which are another animal's in every piece.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from diagnose.pipeline import DiagnoseOptions, diagnose
from diagnose.result import Diagnosis
from diagnose.whiten import NuisanceOptions
from mechanics.box_mesh import box_mesh
from mechanics.effects.registry import effect
from mechanics.effects.settings import Touch
from mechanics.effects.viscoelasticity import LAW as PRONY
from mechanics.errors import RecordingError
from mechanics.material import Material
from mechanics.model import Model, Support, Tool
from mechanics.press_cutting import cut
from mechanics.recording import Recording
from palpate.benchmarks.timing import table
from reconstruct.external.relaxation import FORMS, Held, fit_holds, hold_error

SUMMARY = "diagnosis of measured meat indentations (ramp and hold)"
RADIUS_M = 0.005
SPACING_M = 0.05
FREE_S = 1.5
RATE_HZ = 200.0
NOISE_N = 0.005


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Folder, session, how many pieces."""
    parser.add_argument("--data", required=True, help="folder with the CSVs of the pieces")
    parser.add_argument("--session", default="230331", help="the pieces whose names begin so")
    parser.add_argument("--pieces", type=int, default=16, help="at most so many")
    parser.add_argument("--holds-only", action="store_true", help="only the holds, from their own ramps")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Diagnose the pieces as one recording, then each half to tell the holds of the other; print both."""
    pieces = sorted(Path(arguments.data).glob(f"{arguments.session}_[RF]*.csv"))[: arguments.pieces]
    if len(pieces) < 6:
        raise RecordingError(f"--data {arguments.data} holds {len(pieces)} pieces of session "
                             f"{arguments.session}; at least 6 are needed")  # fmt: skip
    figures: dict[str, Any] = {"pieces": len(pieces)}
    if not arguments.holds_only:
        result = diagnosed(pieces)
        print(f"{len(pieces)} pieces")
        print("\n".join(result.words()))
        figures |= result.as_json()
    figures["unseen_holds"] = unseen_holds(pieces, diagnosing=not arguments.holds_only)
    rows = [
        [form, f"{f['rms_n']:.3f} N", f"{f['closed']:.0%}"] for form, f in figures["unseen_holds"].items()
    ]
    print(table(["memory", "unseen holds miss by (rms)", "closed of what none leaves"], rows))
    return figures


def diagnosed(pieces: list[Path]) -> Diagnosis:
    """The pieces as one recording on one slab."""
    recording, model = slab(pieces)
    # pieces differ in thickness and grain: in stiffness by a quarter, in the power of their depth law as well
    nuisance = NuisanceOptions(site_stiffness=0.25, onset_m=0.5e-3, law=0.25)
    return diagnose(recording, model, DiagnoseOptions(fast=True), nuisance=nuisance)


def unseen_holds(pieces: list[Path], *, diagnosing: bool = True) -> dict[str, dict[str, float]]:
    """How far each form of memory, found in one half of the pieces, misses the other half's holds, N rms.

    'diagnosed': the terms that a diagnosis of that half names; the others are fitted to its own holds.
    """
    presses = [held(path) for path in pieces]
    halves = [(list(range(k, len(pieces), 2)), list(range(1 - k, len(pieces), 2))) for k in (0, 1)]
    errors: dict[str, list[np.ndarray]] = {form: [] for form in FORMS}
    if diagnosing:
        errors["diagnosed"] = []
    for seen, unseen in halves:
        terms = {form: fit_holds([presses[k] for k in seen], form) for form in FORMS}
        if diagnosing:
            terms["diagnosed"] = _named_terms(diagnosed([pieces[k] for k in seen]))
        for form, (g, tau) in terms.items():
            errors[form] += [hold_error(presses[k], g, tau) for k in unseen]
    rms = {form: float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for form, e in errors.items()}
    return {form: {"rms_n": each, "closed": 1 - each / rms["elastic"]} for form, each in rms.items()}


def _named_terms(result: Diagnosis) -> tuple[np.ndarray, np.ndarray]:
    """(g, tau_s) of the relaxation that a diagnosis names; no memory where it names none."""
    touch = Touch()
    for entry in result.entries:
        known = effect(entry.name)
        if entry.name in result.effects and known.phenomenon == "relaxation":
            known.set_touch(touch, entry.parameters, None)
    pairs = touch.numbers.get(PRONY, np.array([0.0, 1.0])).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def held(path: Path) -> Held:
    """A piece's force, scaled as in `slab`, from just before its first touch."""
    t, force, depth = (column for column in np.loadtxt(path, delimiter=",", skiprows=1)[:, :3].T)
    force = force - np.median(force[:3])
    ramp = slice(0, int(depth.argmax()))
    force = force / np.interp(3.0, depth[ramp], force[ramp])
    begin = max(int(np.flatnonzero(force > 0.02)[0]) - 1, 0)
    return Held(t[begin:], force[begin:], int(force.argmax()) - begin)


def slab(pieces: list[Path]) -> tuple[Recording, Model]:
    """(recording, model): the pieces side by side on a slab as thick as they are in the median."""
    tables = [_finer(np.loadtxt(p, delimiter=",", skiprows=1)) for p in pieces]
    rng = np.random.default_rng(0)
    height = float(np.median([t[0, 3] for t in tables])) * 1e-3
    times, centres, forces, found = [], [], [], []
    clock = 0.0
    for k, piece in enumerate(tables):
        early = round(0.3 * RATE_HZ)
        t, force, depth = piece[:, 0], piece[:, 1] - np.median(piece[:early, 1]), piece[:, 2] * 1e-3
        force = force / np.interp(3e-3, depth[: depth.argmax()], force[: depth.argmax()])
        x = (k - (len(tables) - 1) / 2) * SPACING_M
        touched = np.flatnonzero(force > 0.02)[0]
        # interpolated readings have lost their noise, and there is none in the air after a piece
        force = force + rng.normal(0, NOISE_N, len(force))
        surface = depth[touched]
        peak = int(force.argmax())
        lift = np.arange(1 / RATE_HZ, FREE_S, 1 / RATE_HZ)
        t = t - t[0]
        times.append(clock + np.concatenate([t, t[-1] + lift]))
        z = height + RADIUS_M - np.concatenate([depth - surface, np.full(len(lift), -5e-3)])
        centres.append(np.column_stack([np.full_like(z, x), np.zeros_like(z), z]))
        pressed = np.concatenate([force, rng.normal(0, NOISE_N, len(lift))])
        sideways = rng.normal(0, NOISE_N, (len(z), 2))
        forces.append(np.column_stack([sideways, pressed]))
        found.append((clock + t[touched], clock + t[peak], (x, 0.0, height + RADIUS_M)))
        clock += t[-1] - t[0] + FREE_S
    recording = Recording(
        t=np.concatenate(times), position=np.concatenate(centres), force_on_tool=np.concatenate(forces),
        sample_rate_hz=RATE_HZ, tip_radius_m=RADIUS_M, poisson_ratio=0.49, force_noise_std_n=NOISE_N,
        object_name="meat",
    )  # fmt: skip
    length = SPACING_M * (len(tables) + 1)
    mesh = box_mesh((round(length / 0.01), 5, 2), (length, 0.05, height)).quadratic()
    model = Model(
        mesh=mesh, material=Material(2e4, 0.49), support=Support(np.zeros(3), np.array([0, 0, 1.0])),
        tool=Tool(RADIUS_M), mesh_size_m=0.01,
        presses=cut(
            recording, onset_s=np.array([f[0] for f in found]), peak_s=np.array([f[1] for f in found]),
            centre=np.array([f[2] for f in found]), normal=np.tile([0.0, 0.0, 1.0], (len(found), 1)),
        ),
    )  # fmt: skip
    return recording, model


def _finer(piece: np.ndarray) -> np.ndarray:
    """The columns at RATE_HZ, straight between the machine's readings."""
    t = np.arange(piece[0, 0], piece[-1, 0], 1 / RATE_HZ)
    return np.column_stack([t, *(np.interp(t, piece[:, 0], column) for column in piece[:, 1:].T)])
