"""What the blind diagnosis is worth: rates with intervals, confusion, detection by size, calibration."""

from __future__ import annotations

from collections import Counter, defaultdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table

FAMILIES = {"poroelasticity": ("viscoelasticity",), "plasticity": ("mullins_softening",)}
"""What effects that the library has never had may be taken for, as declared; 'unknown' is right as well."""
TARGETS = {
    "false alarms (controls)": "at most 2 %",
    "first place": "at least 80 % at 4 times the limit",
    "first place or declared equal": "at least 90 %",
    "truth in the candidate set": "at least 95 %",
    "unknown recognised": "at least 80 %",
    "absent effect recognised": "at least 80 %",
    "pair: both named": "at least 70 %",
    "pair: one of them first": "at least 90 %",
}
SIZES_IN_NOISE = (0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 1e9)
"""Edges of the detection curve: the effect's own force (best factor taken off) over the vector noise."""


def wilson(hits: int, of: int) -> tuple[float, float, float]:
    """(rate, low, high): Wilson's 95 % interval; all nan for none."""
    if of == 0:
        return (float("nan"),) * 3
    z, p = 1.959964, hits / of
    centre = (p + z * z / (2 * of)) / (1 + z * z / of)
    half = z * np.sqrt(p * (1 - p) / of + z * z / (4 * of * of)) / (1 + z * z / of)
    return p, max(0.0, centre - half), min(1.0, centre + half)


def summarise(done: list[dict[str, Any]]) -> dict[str, Any]:
    """Everything the tables and pictures show, of opened cases (case, verdict, truth)."""
    rates: dict[str, list[bool]] = defaultdict(list)
    confusion: Counter[tuple[str, str]] = Counter()
    by_size: dict[int, list[tuple[bool, bool]]] = defaultdict(list)
    misses, closed, regressed, named_by_bic, sizes, errors = [], [], [], [], [], []
    calibration: list[tuple[float, bool]] = []
    for item in done:
        case, verdict = item["case"], item["verdict"]
        true, named = list(case["effects"]), verdict["effects"]
        candidates = [*named, *verdict["candidates"]]
        detected = verdict["kind"] not in ("none", "failed")
        first = named[0] if named else verdict["kind"]
        kind = case["kind"]
        calibration += [(p, name in true) for name, p in verdict.get("probability", {}).items()]
        if kind == "control":
            hit = not detected
            rates["false alarms (controls)"].append(detected)
            rates["BIC baseline: false alarms (controls)"].append(verdict.get("bic") not in (None, "none"))
        elif kind == "single":
            hit = first == true[0]
            _single(rates, case, verdict, detected, first, candidates)
            sizes.append(len(candidates))
            size = _size(item)
            by_size[int(np.searchsorted(SIZES_IN_NOISE, size, side="right") - 1)].append((detected, hit))
            errors += _parameter_errors(item) if true[0] in named else []
            if hit and verdict["gap_closed"] is not None:
                closed.append(verdict["gap_closed"])
                excess = verdict["gap_before_n"] ** 2 - verdict["noise_n"] ** 2
                left = verdict["regression_gap_n"] ** 2 - verdict["noise_n"] ** 2
                regressed.append(1 - left / excess if excess > 0 else np.nan)
            named_by_bic.append(verdict.get("bic"))
        elif kind in ("left-out", "absent"):
            allowed = FAMILIES.get(true[0], ())
            hit = "unknown" in verdict["kind"] or verdict["kind"] == "ambiguous" or first in allowed
            rates["unknown recognised" if kind == "left-out" else "absent effect recognised"].append(hit)
        else:
            hit = set(true) <= set(named)
            rates["pair: both named"].append(hit)
            rates["pair: one of them first"].append(first in true)
        label = "+".join(true) or "none"
        confusion[(f"({label})" if kind in ("left-out", "absent") else label, first)] += 1
        if not hit:
            misses.append({"case": item["key"], "verdict": verdict["kind"], "effects": named,
                           "candidates": verdict["candidates"]})  # fmt: skip
    return {
        "rates": {k: _rate(v) for k, v in sorted(rates.items())},
        "detection_by_size": [
            {"from": SIZES_IN_NOISE[i], "to": SIZES_IN_NOISE[i + 1], "detected": _rate([d for d, _ in v]),
             "named_first": _rate([h for _, h in v])}
            for i, v in sorted(by_size.items())
        ],
        "confusion": [[a, b, n] for (a, b), n in sorted(confusion.items())],
        "median_gap_closed": _median(closed),
        "median_gap_closed_by_regression": _median(regressed),
        "median_parameter_error": _median([e for _, e in errors]),
        "parameter_errors": errors,
        "mean_candidates": float(np.mean(sizes)) if sizes else None,
        "calibration": _calibration(calibration),
        "misses": misses,
    }  # fmt: skip


def _single(rates, case, verdict, detected, first, candidates) -> None:  # type: ignore[no-untyped-def]
    name = next(iter(case["effects"]))
    rates[f"detected at strength {case['effects'][name]:g}"].append(detected)
    rates["first place"].append(first == name)
    rates["first place or declared equal"].append(name in candidates)
    rates["truth in the candidate set"].append(name in candidates)
    rates["BIC baseline: first place"].append(verdict.get("bic") == name)
    rates["confidently wrong (a name, no candidates, truth not in it)"].append(
        verdict["kind"] == "effect" and name not in candidates
    )


def _rate(hits: list[bool]) -> dict[str, Any]:
    return {"hits": sum(hits), "of": len(hits), "rate_and_interval": wilson(sum(hits), len(hits))}


def _median(values: list[float]) -> float | None:
    return float(np.nanmedian(values)) if len(values) else None


def _size(item: dict[str, Any]) -> float:
    """The effect's rms force, a common factor taken off, over the vector noise; nan where not told."""
    name = next(iter(item["case"]["effects"]))
    about = item["truth"].get("sizes", {}).get(name, {})
    value = about.get("rms_after_best_scale_n", about.get("rms_n", np.nan))
    return float(value) / max(float(item["verdict"].get("noise_n", np.nan)), 1e-9)


def _parameter_errors(item: dict[str, Any]) -> list[tuple[str, float]]:
    """(effect.key, relative error) of every scalar or vector parameter that both state."""
    found = []
    for name, keys in item["verdict"]["parameters"].items():
        true = item["truth"].get("parameters", {}).get(name, {})
        for key, value in keys.items():
            if key not in true or isinstance(value, bool) or isinstance(true[key], str):
                continue
            a, b = np.atleast_1d(np.asarray(value, float)), np.atleast_1d(np.asarray(true[key], float))
            if key == "g":
                a, b = a.sum(keepdims=True), b.sum(keepdims=True)
            if a.shape == b.shape and np.linalg.norm(b) > 0:
                found.append((f"{name}.{key}", float(np.linalg.norm(a - b) / np.linalg.norm(b))))
    return found


def _calibration(pairs: list[tuple[float, bool]]) -> dict[str, Any]:
    """Expected calibration error over ten bins of stated probability, and the bins."""
    if not pairs:
        return {"expected_error": None, "cases": 0, "bins": []}
    p = np.array([a for a, _ in pairs])
    hit = np.array([b for _, b in pairs])
    index = np.minimum((p * 10).astype(int), 9)
    bins = [
        {
            "stated": float(p[index == i].mean()),
            "true": float(hit[index == i].mean()),
            "of": int((index == i).sum()),
        }
        for i in range(10)
        if (index == i).any()
    ]
    error = sum(b["of"] * abs(b["stated"] - b["true"]) for b in bins) / len(p)
    return {"expected_error": float(error), "cases": len(p), "bins": bins}


def show(summary: dict[str, Any]) -> None:
    """Print the tables."""
    rows = []
    for name, value in summary["rates"].items():
        p, low, high = value["rate_and_interval"]
        rate = f"{p:.0%} ({low:.0%} to {high:.0%})"
        rows.append([name, f"{value['hits']}/{value['of']}", rate, TARGETS.get(name, "")])
    print(table(["what", "counts", "rate (95 %)", "target"], rows))
    print(table(["effect's force over noise", "cases", "detected", "named first"], [
        [f"{b['from']:g} to {b['to']:g}", str(b["detected"]["of"]),
         *(f"{b[k]['rate_and_interval'][0]:.0%}" for k in ("detected", "named_first"))]
        for b in summary["detection_by_size"]]))  # fmt: skip
    for name, words in (
        ("median_gap_closed", "median gap closed with the right effect (target 0.85)"),
        ("median_gap_closed_by_regression", "the same by the regression that names nothing"),
        ("median_parameter_error", "median relative error of parameters (target 0.15)"),
        ("mean_candidates", "mean size of the candidate set (target at most 2)"),
    ):
        value = summary[name]
        print(f"{words}: {'-' if value is None else f'{value:.2f}'}")
    calibration = summary["calibration"]
    if calibration["cases"]:
        print(f"expected calibration error over {calibration['cases']} stated probabilities (target 0.05): "
              f"{calibration['expected_error']:.3f}")  # fmt: skip
    print(table(["truth", "first", "cases"], [[a, b, str(n)] for a, b, n in summary["confusion"]]))
    if summary["misses"]:
        print(table(["missed", "verdict", "named", "candidates"],
                    [[m["case"], m["verdict"], ", ".join(m["effects"]), ", ".join(m["candidates"])]
                     for m in summary["misses"]]))  # fmt: skip


def pictures(summary: dict[str, Any], path: Path | str) -> Path:
    """The confusion matrix and the stated probabilities against what was true, as one PNG."""
    from matplotlib.figure import Figure

    rows = sorted({a for a, _, _ in summary["confusion"]})
    columns = sorted({b for _, b, _ in summary["confusion"]})
    counts = np.zeros((len(rows), len(columns)))
    for a, b, n in summary["confusion"]:
        counts[rows.index(a), columns.index(b)] = n
    figure = Figure(figsize=(13, 2.5 + 0.26 * len(rows)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[2.2, 1])
    left.imshow(np.where(counts > 0, counts, np.nan), cmap="Blues", vmin=0, aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        left.text(j, i, f"{counts[i, j]:.0f}", ha="center", va="center", fontsize=8)
    left.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=60, ha="right")
    left.set_yticks(range(len(rows)), [r.replace("_", " ") for r in rows])
    left.set(xlabel="named first", ylabel="sealed (in brackets: not in the library)")
    bins = summary["calibration"]["bins"]
    right.plot([0, 1], [0, 1], color="#999999", lw=0.8)
    right.scatter([b["stated"] for b in bins], [b["true"] for b in bins],
                  s=[10 + 2 * b["of"] for b in bins], color="#1d3557")  # fmt: skip
    right.set(xlabel="stated probability", ylabel="share that was true", title="calibration (area: cases)")
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)
    return path
