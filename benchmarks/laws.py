"""Laws of tissue as whole recordings: simulated, reconstructed, diagnosed; is the law named, and how near?

Everything else is drawn by seed from benchmarks.varied (object, modulus, frame, hand, presses, instrument,
what the file states), the law's strength within --strength. Told: the law's size (rms of the force's change
beside the best common factor, over the noise of a reading's vector), the verdict, the law's keys against the
truth, and whether their 95 % intervals hold it. Touches that were never solved are solved first (minutes an
object, more where the law needs a solid of its own).
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import palpate as pp
from benchmarks.timing import table
from benchmarks.varied.draws import draw
from benchmarks.varied.objects import thing
from benchmarks.varied.recorded import explored
from benchmarks.varied.writing import write
from palpate.mechanics.errors import OptionError, PalpateError
from palpate.scenes.laboratory.curves import Solving
from palpate.scenes.laboratory.effects import REGISTRY

LAWS = ("power_law_relaxation", "poroelasticity", "jkr_adhesion", "adhesion")
OBJECTS, LEAST_PRESSES = 6, 18
SKIPPED = ("tip_radius_m", "plane_strain_modulus_pa")
"""Keys of the laboratory that are no parameter of the law."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Which laws, how many recordings of each."""
    parser.add_argument("--laws", nargs="+", default=LAWS, metavar="LAW", help=f"default: {', '.join(LAWS)}")
    parser.add_argument("--recordings", type=int, default=2, help="of each law (default: 2)")
    parser.add_argument(
        "--strength", type=float, nargs=2, default=(0.5, 2.5), metavar=("LEAST", "MOST"),
        help="between which strengths are drawn, evenly in their logarithm; both may be negative",
    )  # fmt: skip
    parser.add_argument("--presses", type=int, default=36, help="of a recording, at most (default: 36)")
    parser.add_argument("--seed", type=int, default=913, help="of the draws (default: 913)")
    parser.add_argument("--touches", type=Path, metavar="FOLDER", help="solved touches (default: the user's)")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Record, reconstruct, diagnose; a line a recording."""
    for law in arguments.laws:
        if law not in REGISTRY:
            raise OptionError(f"--laws {law}: it is unknown; allowed are {', '.join(REGISTRY)}")
    least, most = arguments.strength
    if not least * most > 0:
        raise OptionError(f"--strength is {least:g} {most:g}; both must be above 0, or both below")
    rng = np.random.default_rng(arguments.seed)
    found = []
    for _ in range(arguments.recordings):
        for law in arguments.laws:
            strength = np.sign(least) * np.exp(rng.uniform(*np.sort(np.log(np.abs([least, most])))))
            seed, number = int(rng.integers(100_000, 200_000)), int(rng.integers(0, OBJECTS))
            found.append(
                one(law, round(float(strength), 2), seed, number, arguments.presses, arguments.touches)
            )
            print(_line(found[-1]), flush=True)
    head = [
        "law", "strength", "object", "size / noise",
        "verdict", "key", "true", "found", "95 % interval", "holds",
    ]  # fmt: skip
    print(table(head, [row for each in found for row in _rows(each)]))
    return {"recordings": found}


def one(law: str, strength: float, seed: int, number: int, most: int, touches: Path | None) -> dict[str, Any]:
    """One recording of a law, and what came of it."""
    drawn = replace(draw(seed), number=number)
    drawn = replace(drawn, presses=int(np.clip(drawn.presses, LEAST_PRESSES, max(most, LEAST_PRESSES))))
    kept = Solving(workers=1, cache=touches)
    made = explored(drawn, {law: strength}, it=thing(number), sizes=True, solving=kept)
    truth = dict(made.recording.truth or {})
    row: dict[str, Any] = {
        "law": law, "strength": strength, "seed": seed, "object": made.thing.phantom.name,
        "true": truth["parameters"][law], "young_modulus_pa": truth["young_modulus_pa"],
        "size_n": truth["sizes"][law]["rms_after_best_scale_n"], "noise_n": drawn.noise_n,
    }  # fmt: skip
    with TemporaryDirectory() as folder:
        path = write(Path(folder) / "recording.csv.gz", made.recording, drawn)
        try:
            model = pp.reconstruct(path, progress=False)
            answer = pp.diagnose(path, model, progress=False)
        except PalpateError as error:
            return {**row, "refused": str(error)}
    entry = next((e for e in answer.entries if e.name == law), None)
    return {
        **row,
        "kind": answer.kind, "effects": list(answer.effects), "candidates": list(answer.candidates),
        "named": law in answer.effects,
        "gap_closed": answer.gap_closed,
        "found": {} if entry is None else dict(entry.parameters),
        "interval": {} if entry is None else dict(entry.intervals),
        "found_young_modulus_pa": answer.young_modulus_pa,
    }  # fmt: skip


def _over_noise(row: Mapping[str, Any]) -> float:
    """The law's size over the noise of a reading's vector."""
    return float(row["size_n"] / (row["noise_n"] * np.sqrt(3)))


def _line(row: Mapping[str, Any]) -> str:
    what = f"{row['law']} {row['strength']:g} ({_over_noise(row):.2g} of the noise)"
    head = f"{what} on {row['object']}, seed {row['seed']}: "
    if "refused" in row:
        return head + f"refused ({row['refused']})"
    beside = f"; cannot be told from {', '.join(row['candidates'])}" if row["candidates"] else ""
    return head + (", ".join(row["effects"]) or row["kind"]) + beside


def _rows(row: Mapping[str, Any]) -> list[list[Any]]:
    """A line a key of the law."""
    verdict = "refused" if "refused" in row else "named" if row["named"] else row["kind"]
    of = [row["law"], row["strength"], row["object"], _over_noise(row), verdict]
    out = []
    for key, true in row["true"].items():
        value, between = row.get("found", {}).get(key), row.get("interval", {}).get(key)
        if key in SKIPPED or not isinstance(true, int | float) or not isinstance(value, int | float):
            continue
        low, high = between or (np.nan, np.nan)
        holds = "" if between is None else "yes" if low <= true <= high else "no"
        out.append([*of, key, f"{true:.3g}", f"{value:.3g}", f"{low:.3g} to {high:.3g}", holds])
    return out or [[*of, "", "", "", ""]]
