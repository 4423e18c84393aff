"""The blind benchmark's tables and pictures, targets beside what was measured."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table

TARGETS = {
    "false alarms (controls)": "at most 2 %",
    "detected, effect at least twice what can be seen": "at least 95 %",
    "first place, effect at least 4 times what can be seen": "at least 80 %",
    "first place or declared equal, at least 4 times what can be seen": "at least 90 %",
    "detected, effect at least twice the noise": "at least 95 %",
    "first place, effect at least 4 times the noise": "at least 80 %",
    "first place or declared equal, at least 4 times the noise": "at least 90 %",
    "truth in the candidate set (where detected)": "at least 95 %",
    "left out of the library: unknown or ambiguous": "at least 80 %",
    "absent effect: unknown, ambiguous or its declared family": "at least 80 %",
    "complete protocol: tool compliance found": "at least 5 of 6",
    "complete protocol: surface offset found": "at least 5 of 6",
    "complete protocol: delay, play and viscoelasticity told apart": "at least 9 of 10",
    "pair: both named": "at least 70 %",
    "pair: the dominant one named": "at least 90 %",
}


_WHERE = {"there": "half the noise or more", "most": "and half of the largest bin's"}


def _percent(value: dict[str, Any]) -> str:
    p, low, high = value["rate_and_interval"]
    return f"{p:.0%} ({low:.0%} to {high:.0%})" if value["of"] else "-"


def show(summary: dict[str, Any]) -> None:
    """Print the tables."""
    size = summary["size"]
    print(f"cases: {size['done']} done of {size['asked']}" + ("; --fast" if size["fast"] else ""))
    order = [*TARGETS, *(n for n in summary["rates"] if n not in TARGETS)]
    rows = [
        [n, f"{v['hits']}/{v['of']}", _percent(v), TARGETS.get(n, "")]
        for n, v in ((n, summary["rates"][n]) for n in order if n in summary["rates"])
    ]
    coverage = summary["parameter_coverage"]
    rows.append(["parameter inside its 95 % interval", f"{coverage['hits']}/{coverage['of']}",
                 _percent(coverage), "90 to 98 %"])  # fmt: skip
    for name, words, target in (
        ("median_gap_closed", "median gap closed with the right effect", "at least 0.85"),
        ("median_gap_closed_by_regression", "the same by a regression that names nothing", ""),
        ("median_parameter_error", "median relative error of parameters", "at most 0.15"),
        ("mean_candidates", "mean size of the candidate set", "at most 2"),
        ("median_seconds", "median wall time of a diagnosis, s", "at most 180"),
    ):
        value = summary[name]
        rows.append([words, "", "-" if value is None else f"{value:.2f}", target])
    for key, words in (("calibration", ""), ("calibration_of_said", " of names and candidates")):
        stated = summary[key]
        if stated["cases"]:
            rows.append([f"expected calibration error{words} ({stated['cases']} probabilities)", "",
                         f"{stated['expected_error']:.3f}", "at most 0.05"])  # fmt: skip
    print(table(["what", "counts", "rate (95 %)", "target"], rows))
    head = ["where the gap is", "cases", "bins: right/said/true/all", "F1 (95 %)", "F1 of every bin"]
    print(table(head, [
        [f"{kind}, {_WHERE[word]}", str(v["cases"]), "{right}/{said}/{true}/{bins}".format(**v),
         "{:.2f} ({:.2f} to {:.2f})".format(v["f1"], *v["f1_ci95"]), f"{v['f1_of_every_bin']:.2f}"]
        for kind, each in summary["localisation"].items() for word, v in each.items()]))  # fmt: skip
    print(table(["effect's force over noise", "cases", "detected", "named first", "in the set"], [
        [f"{b['from']:g} to {b['to']:g}" if b["to"] < 1e8 else f"above {b['from']:g}",
         str(b["detected"]["of"]), *(_percent(b[k]) for k in ("detected", "named_first", "in_set"))]
        for b in summary["detection_by_size"]]))  # fmt: skip
    print(table(["effect", "strength", "cases", "detected", "named first"], [
        [b["effect"], f"{b['strength']:g}", str(b["of"]), str(b["detected"]), str(b["first"])]
        for b in summary["by_effect"]]))  # fmt: skip
    print(table(["effect", "protocol", "cases", "can be seen from strength, median", "least", "most"], [
        [b["effect"], b["protocol"] or "ordinary", str(b["of"]),
         *(f"{b[k]:.2g}" for k in ("median", "least", "most"))] for b in summary["seen_from"]]))  # fmt: skip
    print(table(["parameter", "cases", "median relative error", "inside its interval"], [
        [k, str(v["of"]), f"{v['median']:.2f}",
         "{}/{}".format(*summary["parameter_coverage_by_key"].get(k, (0, 0)))]
        for k, v in summary["parameter_errors"].items()]))  # fmt: skip
    print(table(["truth", "first", "cases"], [[a, b, str(n)] for a, b, n in summary["confusion"]]))
    if summary["misses"]:
        print(table(["missed", "verdict", "named", "candidates"],
                    [[m["case"], m["verdict"], ", ".join(m["effects"]), ", ".join(m["candidates"])]
                     for m in summary["misses"]]))  # fmt: skip


def pictures(summary: dict[str, Any], path: Path | str) -> Path:
    """Confusion matrix, detection by size, and stated probabilities against what was true, as one PNG."""
    from matplotlib.figure import Figure

    rows = sorted({a for a, _, _ in summary["confusion"]})
    columns = sorted({b for _, b, _ in summary["confusion"]})
    figure = Figure(figsize=(14, 3.5 + 0.26 * len(rows)), layout="constrained")
    axes = figure.subplot_mosaic([["matrix", "curve"], ["matrix", "calibration"]], width_ratios=[2.0, 1])
    _confusion(axes["matrix"], summary["confusion"], rows, columns)
    _curve(axes["curve"], summary["detection_by_size"])
    bins = summary["calibration"]["bins"]
    axes["calibration"].plot([0, 1], [0, 1], color="#999999", lw=0.8)
    axes["calibration"].scatter(
        [b["stated"] for b in bins], [b["true"] for b in bins],
        s=[15 + 4 * np.sqrt(b["of"]) for b in bins], color="#1d3557",
    )  # fmt: skip
    axes["calibration"].set(xlabel="stated probability", ylabel="share that was true", title="calibration")
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    return path


def _confusion(axis: Any, counts: list[list[Any]], rows: list[str], columns: list[str]) -> None:
    matrix = np.zeros((len(rows), len(columns)))
    for a, b, n in counts:
        matrix[rows.index(a), columns.index(b)] = n
    share = matrix / np.maximum(matrix.sum(axis=1, keepdims=True), 1)
    axis.imshow(np.where(matrix > 0, share, np.nan), cmap="Blues", vmin=0, vmax=1.4, aspect="auto")
    for i, j in zip(*np.nonzero(matrix), strict=True):
        axis.text(j, i, f"{matrix[i, j]:.0f}", ha="center", va="center", fontsize=8)
    axis.set_xticks(range(len(columns)), [c.replace("_", " ") for c in columns], rotation=60, ha="right")
    axis.set_yticks(range(len(rows)), [r.replace("_", " ").replace("+", " + ") for r in rows])
    axis.set(xlabel="named first", ylabel="sealed (in brackets: not in the library)")


def _curve(axis: Any, bins: list[dict[str, Any]]) -> None:
    for key, words, colour, shift in (
        ("detected", "something is there", "#1d3557", -0.06),
        ("named_first", "named first", "#e63946", 0.06),
    ):
        of = [b for b in bins if b[key]["of"]]
        x = np.arange(len(of)) + shift
        p, low, high = np.array([b[key]["rate_and_interval"] for b in of]).reshape(-1, 3).T
        bars = np.maximum([p - low, high - p], 0.0)  # rounding
        axis.errorbar(x, p, yerr=bars, fmt="o-", color=colour, label=words, capsize=3)
        axis.set_xticks(np.arange(len(of)), [
            (f"{b['from']:g}-{b['to']:g}" if b["to"] < 1e8 else f">{b['from']:g}") + f"\n({b[key]['of']})"
            for b in of])  # fmt: skip
    axis.set(ylim=(-0.03, 1.03), xlabel="effect's force over the noise (cases)", ylabel="share, Wilson 95 %")
    axis.legend(loc="lower right")
