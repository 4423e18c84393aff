"""Tissue that is not one modulus: who predicts presses that were held out, and how true is the map?

Slabs with a random field of the modulus (in half of all cases with a layer on top), pressed once a place on a
raster of 5 to 9 mm, are solved exactly on fine elements (benchmarks._tissue). Held out, by folds over
places: the finite-element model with the field that the other presses ask for, with one modulus, both
interpolated 1D models, and each place's own modulus in the finite-element model of one modulus, interpolated.
Then the same with first touches that are read 0.3 mm wrong: as read, and moved by what that error allows, for
every model alike. `truth` is the slab itself along the same paths: noise, and where touches are read wrong
what no model could know. Errors beyond the truth are sqrt(rms^2 - truth^2).

The map: ln E half a tip radius under the touched places against the truth there (correlation, rms error,
contrast: slope of found on true) and the share of places whose 95 % interval holds the truth. Homogeneous
slabs are among the cases: there no field must be found.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from scipy.interpolate import RBFInterpolator

from benchmarks._tissue import Tissue, tissue
from benchmarks.timing import table
from palpate.diagnosis.compare.comparison import CompareOptions, Comparison, compare_presses
from palpate.diagnosis.compare.models import HOMOGENEOUS, RIVALS, Prepared, as_touched, prepare
from palpate.output import progress_bar
from palpate.reconstruction.steps.s7_modulus.modulus_field import asked_for, fit_field, map_sd, with_field

PER_PLACE, TRUTH = "modulus-by-place", "truth"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many slabs, how large, how different."""
    parser.add_argument("--cases", type=int, default=4, help="slabs with a field (default: 4)")
    parser.add_argument("--homogeneous", type=int, default=1, help="slabs without (default: 1)")
    parser.add_argument("--raster", type=int, default=6, help="presses along a side (default: 6)")
    parser.add_argument("--log-sd", type=float, default=0.35, help="standard deviation of ln E")
    parser.add_argument("--touch-error", type=float, default=3e-4, help="of first touches", metavar="M")
    parser.add_argument("--seed", type=int, default=0, help="of the first slab")
    parser.add_argument("--map", action="store_true", help="the map alone, no presses held out")


def per_place(result: Comparison, options: CompareOptions) -> np.ndarray:
    """(n, 3) N: every press by the modulus of one-modulus fits of single presses, interpolated to it."""
    prepared, presses = result.prepared, result.presses
    law = min(prepared.own, key=lambda name: prepared.own[name].fit.cost.sum())
    log = np.log(prepared.own[law].fit.modulus_pa)
    out = np.zeros_like(presses.force)
    whole = with_field(prepared.sites, prepared.places, None)
    for k in np.unique(result.fold):
        held, seen = result.fold == k, result.fold != k
        given = RBFInterpolator(presses.point[seen], log[seen], kernel="linear", degree=0)
        modulus = np.exp(np.clip(given(presses.point), log[seen].min(), log[seen].max()))

        def force(moved: np.ndarray, modulus: np.ndarray = modulus) -> np.ndarray:
            return modulus[presses.press][:, None] * whole.unit_forces(presses, law, moved)

        rows = presses.rows(np.flatnonzero(held))
        out[rows] = as_touched(force, presses, options.first_touch)[rows]
    return out


def errors(slab: Tissue, first_touch: str) -> tuple[dict[str, float], Comparison]:
    """(rms error, N, of each model over held-out presses, the comparison)."""
    options = CompareOptions(first_touch=first_touch)
    result = compare_presses(slab.presses, slab.model, options)
    presses = result.presses
    true = as_touched(lambda moved: slab.forces(presses, moved), presses, first_touch)
    others = {PER_PLACE: per_place(result, options), TRUTH: true}
    rms = {name: float(np.sqrt(((f - presses.force) ** 2).sum(axis=1).mean())) for name, f in others.items()}
    return {**result.rmse_n, **rms}, result


def beyond(error_n: float, least_n: float) -> float:
    """N."""
    return float(np.sqrt(max(error_n**2 - least_n**2, 1e-12)))


def map_of(slab: Tissue, prepared: Prepared) -> dict[str, float]:
    """How true the field of all presses is at the touched places."""
    own = min(prepared.own.values(), key=lambda o: o.fit.cost.sum())
    found = fit_field(own, np.arange(len(slab.presses)))
    if found is None:
        return {}
    if not asked_for(found):
        return {"asked_for": 0.0, "gain": found.gain, "explained": found.explained}
    touched = len(np.unique(own.site))
    places = found.field.places[:touched]
    true = slab.log_ratio(places) + np.log(slab.modulus_pa)
    told = found.level + found.field.log_ratio[:touched]
    sd = map_sd(found, slab.presses.tip_radius_m)[:touched]
    return {
        "asked_for": float(asked_for(found)),
        "gain": found.gain,
        "explained": found.explained,
        "true_sd": float(true.std()),
        "rms_error": float(np.sqrt(np.mean((told - true) ** 2))),
        "correlation": float(np.corrcoef(told, true)[0, 1]) if true.std() > 0 else float("nan"),
        "contrast": float(np.polyfit(true, told, 1)[0]) if true.std() > 0 else float("nan"),
        "coverage": float(np.mean(np.abs(told - true) < 1.96 * sd)),
    }


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Measure; print a table a setting; return the figures."""
    found: dict[str, Any] = {"cases": []}
    count = arguments.cases + arguments.homogeneous
    progress = progress_bar("slabs")
    for k in range(count):
        sd = arguments.log_sd if k < arguments.cases else 0.0
        seed = arguments.seed + k
        for error, ways in ((0.0, ("read",)), (arguments.touch_error, ("read", "moved"))):
            slab = tissue(seed, log_sd=sd, raster=arguments.raster, touch_error_m=error)
            if arguments.map:
                told = map_of(slab, prepare(slab.presses, slab.model))
                found["cases"].append({"seed": seed, "log_sd": sd, "touch_error_m": error, "map": told})
                print(f"slab {seed}, touches {1e3 * error:g} mm" + _map_words(told), flush=True)
                continue
            for way in ways:
                rms, result = errors(slab, way)
                noise = result.noise_n
                best, least = min(rms[name] for name in RIVALS), rms[TRUTH]
                row = {
                    "seed": seed, "log_sd": sd, "touch_error_m": error, "first_touch": way, **slab.about,
                    "rmse_n": rms, "vector_noise_n": noise, "fem_over_best_1d": rms["fem"] / best,
                    "beyond_truth": {name: beyond(value, least) for name, value in rms.items()},
                    "fem_over_best_1d_beyond_truth": beyond(rms["fem"], least) / beyond(best, least),
                    "truth_over_best_1d": least / best,
                    "folds_with_a_field": sum(field is not None for field in result.fields),
                }  # fmt: skip
                if way == ways[0]:
                    row["map"] = map_of(slab, result.prepared)
                found["cases"].append(row)
                _say(row)
        progress("slabs", (k + 1) / count)
    progress.close()
    if arguments.map:
        return found
    found["summary"] = _summary(found["cases"])
    print(table(["setting", *_COLUMNS], [[name, *row] for name, row in found["summary"].items()]))
    return found


def _say(row: dict[str, Any]) -> None:
    rms = row["rmse_n"]
    print(
        f"slab {row['seed']} sd {row['log_sd']:g}, touches {1e3 * row['touch_error_m']:g} mm "
        f"{row['first_touch']}: "
        + ", ".join(f"{name} {1e3 * value:.1f}" for name, value in rms.items())
        + f" mN (noise {1e3 * row['vector_noise_n']:.1f}); FEM over the better 1D model "
        f"{row['fem_over_best_1d']:.2f} (the slab itself {row['truth_over_best_1d']:.2f}), beyond the truth "
        f"{row['fem_over_best_1d_beyond_truth']:.2f}; a field in {row['folds_with_a_field']} folds"
        + _map_words(row.get("map", {})),
        flush=True,
    )


def _map_words(told: dict[str, float]) -> str:
    return "".join(f"; {key} {value:.2f}" for key, value in told.items())


_COLUMNS = (
    "cases", "over 1D", "worst", "truth over 1D", "over 1D beyond truth", "over one modulus", "over by place",
)  # fmt: skip


def _summary(rows: list[dict[str, Any]]) -> dict[str, list[str]]:
    """Medians over the slabs with a field, a setting of first touches a row."""
    out = {}
    for error, way in sorted({(r["touch_error_m"], r["first_touch"]) for r in rows if r["log_sd"] > 0}):
        some = [r for r in rows if r["log_sd"] > 0 and (r["touch_error_m"], r["first_touch"]) == (error, way)]
        over = [r["fem_over_best_1d"] for r in some]
        least = [r["truth_over_best_1d"] for r in some]
        apart = [r["fem_over_best_1d_beyond_truth"] for r in some]
        others = [
            np.median([r["beyond_truth"]["fem"] / r["beyond_truth"][name] for r in some])
            for name in (HOMOGENEOUS, PER_PLACE)
        ]
        out[f"first touch {1e3 * error:g} mm, {way}"] = [
            str(len(some)),
            *(f"{v:.2f}" for v in (np.median(over), max(over), *map(np.median, (least, apart)), *others)),
        ]
    return out
