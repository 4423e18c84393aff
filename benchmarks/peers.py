"""What a person would use instead, on the same tasks in one run: a ball on a block, and held-out presses.

block: a ball of 5 mm pressed into the middle of a block's top (30 kPa, Poisson's ratio 0.49, base fixed),
over Hertz for a half-space; the block is finite and the ball is no parabola, so 1 is not quite the truth.
held out: the presses of a recording in folds over sites (as `palpate compare`), each peer with one modulus
fitted to the other sites and the measured depth of each press; rms of the force vector. A spring-damper map
is Kelvin-Voigt, fitted press by press and taken from the nearest one. Times are processor times of this
machine: compare them with each other alone.
"""

from __future__ import annotations

import argparse
import contextlib
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._peers import (
    DEPTHS_M,
    PEERS,
    POISSON,
    TIP_RADIUS_M,
    YOUNG_PA,
    Peer,
    hertz_n,
    lines_of,
)
from benchmarks.compliance import block
from benchmarks.evidence import Figure
from benchmarks.timing import table
from palpate.mechanics.recording.recording import read_recording

SHARES = np.array([0.25, 0.6, 1.0])
"""Of a press's greatest depth, for which a peer is asked; between them force over depth is straight in the
root of the depth, which Hertz and a spring both are."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How fine the block is, and whose presses are held out."""
    parser.add_argument("--touchable", type=int, default=300, help="nodes of the block that can be touched")
    parser.add_argument(
        "--recording", type=Path, help="whose presses are held out; without it only the block"
    )
    parser.add_argument("--model", type=Path, help="its MODEL folder (default: it is reconstructed)")
    parser.add_argument("--without", nargs="*", default=[], help="names of peers to leave out")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print both tables; returns their figures."""
    chosen = [peer for peer in PEERS if peer.name not in arguments.without]
    # MuJoCo leaves its warnings in a file where it runs
    recording = None if arguments.recording is None else arguments.recording.resolve()
    model = None if arguments.model is None else arguments.model.resolve()
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        result: dict[str, Any] = {"block": [_on_block(peer, arguments.touchable) for peer in chosen]}
        depths = [f"over Hertz at {1e3 * d:g} mm" for d in DEPTHS_M]
        header = ["peer", *depths, "step [CPU us]", "set-up [CPU s]", "lines", "made for"]
        print(table(header, [_row(found) for found in result["block"]]))
        if recording is not None:
            result["held_out"] = held_out(recording, model, chosen)
            print(
                table(
                    ["peer", "held-out error [mN]", "presses"], [list(r.values()) for r in result["held_out"]]
                )
            )
    result["figures"] = [
        Figure(f"{found['peer']}, {what}", value, unit=unit)
        for found in result["block"] if "failed" not in found
        for what, value, unit in (
            (f"force over Hertz at {1e3 * DEPTHS_M[-1]:g} mm", found["over_hertz"][-1], "1"),
            ("CPU of a step", 1e6 * found["step_s"], "us"),
        )
    ] + [
        Figure(f"{row['peer']}, held-out error, rms of {row['presses']} presses", row["rmse_mn"], unit="mN")
        for row in result.get("held_out", []) if row["presses"]
    ]  # fmt: skip
    return result


def _on_block(kind: type[Peer], touchable: int) -> dict[str, Any]:
    mesh = block(touchable, 1)
    found: dict[str, Any] = {"peer": kind.name, "lines": lines_of(kind), "made_for": kind.made_for}
    began = time.process_time()
    try:
        peer = kind(mesh, YOUNG_PA, POISSON, TIP_RADIUS_M)
    except ImportError as error:
        return found | {"failed": f"not installed: {error.name}"}
    except Exception as error:  # a peer's failure is a finding, not ours to hide or to die of
        return found | {"failed": str(error)}
    found["set_up_s"] = time.process_time() - began
    middle = 0.5 * (mesh.points.max(axis=0) + mesh.points.min(axis=0))
    point = np.array([middle[0], middle[1], mesh.points[:, 2].max()])
    forces = peer.force(point, np.array([0.0, 0.0, 1.0]), np.array(DEPTHS_M))
    found["over_hertz"] = [float(f / hertz_n(d)) for f, d in zip(forces, DEPTHS_M, strict=True)]
    found["step_s"] = peer.step_s / max(peer.steps, 1)
    return found


def _row(found: dict[str, Any]) -> list[Any]:
    if "failed" in found:
        return [
            found["peer"],
            found["failed"],
            *[""] * (len(DEPTHS_M) + 1),
            found["lines"],
            found["made_for"],
        ]
    return [
        found["peer"], *found["over_hertz"], 1e6 * found["step_s"], found["set_up_s"], found["lines"],
        found["made_for"],
    ]  # fmt: skip


def held_out(recording: Path, folder: Path | None, chosen: list[type[Peer]]) -> list[dict[str, Any]]:
    """Held-out rms error of each peer, N, over the contact samples of all presses."""
    from palpate.diagnosis.compare.comparison import CompareOptions, compare
    from palpate.mechanics.model.files import read_model

    model = None if folder is None else read_model(folder)
    measured = read_recording(recording)
    result = compare(measured, model, CompareOptions(interpolation="nearest"))
    presses, truth = result.presses, result.presses.force
    rows = [
        {"peer": "palpate", "rmse_mn": 1e3 * result.rmse_n["fem"], "presses": len(presses)},
        {
            "peer": "spring-damper map",
            "rmse_mn": 1e3 * result.rmse_n["kelvin-voigt"],
            "presses": len(presses),
        },
    ]
    mesh, nu = result.model.mesh.linear(), result.model.material.poisson_ratio
    for kind in chosen:
        if kind.name == "palpate":
            continue
        try:
            peer = kind(mesh, float(np.median(result.moduli_pa)), nu, presses.tip_radius_m)
            unit = _forces(peer, presses)
        except ImportError as error:
            rows.append({"peer": kind.name, "rmse_mn": f"not installed: {error.name}", "presses": 0})
            continue
        except Exception as error:  # as above
            rows.append({"peer": kind.name, "rmse_mn": f"failed: {error}"[:80], "presses": 0})
            continue
        predicted = np.zeros_like(truth)
        for k in np.unique(result.fold):
            seen, held = (
                presses.rows(np.flatnonzero(which)) for which in (result.fold != k, result.fold == k)
            )
            scale = float((unit[seen] * truth[seen]).sum() / (unit[seen] ** 2).sum())
            predicted[held] = scale * unit[held]
        rmse = float(np.sqrt(((predicted - truth) ** 2).sum(axis=1).mean()))
        rows.append({"peer": kind.name, "rmse_mn": 1e3 * rmse, "presses": len(presses)})
    return rows


def _forces(peer: Peer, presses: Any) -> np.ndarray:
    """(n, 3) N along each press's normal, from its depth alone."""
    force = np.zeros((len(presses.t), 3))
    for i, part in enumerate(presses.parts):
        depth = np.maximum(presses.depth[part], 0.0)
        grid = SHARES * max(float(depth.max()), 1e-4)
        secant = peer.force(presses.point[i], presses.normal[i], grid) / grid
        root, slope = np.sqrt(grid), (secant[1] - secant[0]) / np.diff(np.sqrt(grid[:2]))[0]
        at_zero = max(float(secant[0] - slope * root[0]), 0.0)
        found = np.interp(np.sqrt(depth), np.append(0.0, root), np.append(at_zero, secant))
        force[part] = (depth * found)[:, None] * presses.normal[i]
    return force
