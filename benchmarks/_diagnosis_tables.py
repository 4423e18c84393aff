"""The blind benchmark's tables, targets beside what was measured."""

from __future__ import annotations

from typing import Any

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
