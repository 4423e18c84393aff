"""Does the 95 % interval cover the modulus? Simulated explorations with known moduli, reconstructed.

The virtual laboratory solves the touches of each phantom once (its cache); a hand, a modulus, a frame and
noise of its own then make one exploration each. Moduli are drawn between 8 and 60 kPa. Errors of the surface
are told beside.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from benchmarks._rates import wilson
from benchmarks._surface_truth import phantom_truth
from benchmarks.surface import deviation
from benchmarks.timing import table
from palpate.output import progress_bar
from reconstruct.pipeline import reconstruct_fully
from scenes.laboratory.hand import cohort_hand
from scenes.laboratory.presses import PROTOCOLS
from scenes.laboratory.simulate import SimulateOptions, simulate
from scenes.phantoms import PHANTOMS, phantom

SUMMARY = "share of simulated explorations whose interval covers the modulus, and their surfaces"
_SOFTEST_PA, _STIFFEST_PA = 8e3, 60e3


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Phantoms, hands, press sets."""
    parser.add_argument("--phantoms", nargs="+", choices=sorted(PHANTOMS), default=["cylinder", "block"])
    parser.add_argument("--hands", type=int, default=4, help="explorations of each press set (default: 4)")
    parser.add_argument("--first-hand", type=int, default=0, help="number of the first hand (default: 0)")
    parser.add_argument("--presses", type=int, nargs="+", default=[0], help="press sets (default: 0)")
    parser.add_argument("--protocol", choices=sorted(PROTOCOLS), default="sparse")
    parser.add_argument("--effect", default=None, help="an effect of strength 1 present in all of them")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print a row an exploration, and the coverage with its own 95 % interval (Wilson)."""
    rows, found = [], []
    sets = [(name, presses) for name in arguments.phantoms for presses in arguments.presses]
    effects = {arguments.effect: 1.0} if arguments.effect else {}
    with progress_bar("explorations") as progress:
        for k, (name, presses) in enumerate(sets):
            for hand in range(arguments.first_hand, arguments.first_hand + arguments.hands):
                entry = _explored(name, presses, hand, arguments.protocol, effects)
                found.append(entry)
                rows.append(_row(entry))
                print(*rows[-1], flush=True)
            progress("explorations", (k + 1) / len(sets))
    covered, count = sum(e["covers"] for e in found), len(found)
    _, low, high = wilson(covered, count)
    errors = np.array([e["error"] for e in found])
    print(table(["phantom", "hand", "true [kPa]", "found", "from", "to", "error", "covers", "law", "surface",
                 "mean mm", "95 % mm", "volume"], rows))  # fmt: skip
    print(f"\ncovered {covered} of {count} ({100 * covered / count:.0f} %, itself {100 * low:.0f} to "
          f"{100 * high:.0f} %); error {100 * errors.mean():+.1f} % in the mean, "
          f"{100 * np.sqrt(np.mean(errors**2)):.1f} % rms")  # fmt: skip
    return {"explorations": found, "covered": covered, "count": count, "wilson95": [low, high]}


def _explored(name: str, presses: int, hand: int, protocol: str, effects: dict[str, float]) -> dict[str, Any]:
    seed = 1000 * presses + hand
    random = np.random.default_rng([seed, sorted(PHANTOMS).index(name)])
    modulus = float(np.exp(random.uniform(np.log(_SOFTEST_PA), np.log(_STIFFEST_PA))))
    options = SimulateOptions(young_modulus_pa=modulus, protocol=protocol, presses=presses, frame=True)
    simulated = simulate(
        phantom(name), effects, options, hand=cohort_hand(hand), seed=seed, sizes=False, workers=1
    )
    result = reconstruct_fully(simulated.recording)
    assert result.modulus is not None, "the finite-tip method fits a modulus"
    low, high = result.model.material.young_modulus_ci95_pa
    turned = np.array(simulated.truth["device_from_object_rotation"])
    shift = np.array(simulated.truth["device_from_object_shift_mm"]) / 1e3
    vertices = (result.surface.vertices - shift) @ turned
    return {
        "phantom": f"{name} {presses}",
        "hand": hand,
        "true_pa": modulus,
        "found_pa": result.model.material.young_modulus_pa,
        "ci95_pa": [low, high],
        "error": result.model.material.young_modulus_pa / modulus - 1,
        "covers": bool(low <= modulus <= high),
        "law": result.modulus.press.law,
        "surface": result.surface.method,
        "delay_s": result.exploration.delay_s,
        **deviation(phantom_truth(name), vertices, result.surface.triangles),
    }


def _row(entry: dict[str, Any]) -> list[Any]:
    return [
        entry["phantom"],
        entry["hand"],
        *(f"{v / 1e3:.2f}" for v in (entry["true_pa"], entry["found_pa"], *entry["ci95_pa"])),
        f"{100 * entry['error']:+.1f} %",
        "yes" if entry["covers"] else "no",
        entry["law"],
        entry["surface"],
        *(f"{1e3 * entry[k]:.2f}" for k in ("mean_m", "p95_m")),
        f"{100 * entry['volume_error']:+.1f} %",
    ]
