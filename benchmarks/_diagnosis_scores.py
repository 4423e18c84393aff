"""What the blind diagnosis is worth: rates with intervals, confusion, detection by size, calibration,
coverage."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import chi2

from benchmarks._diagnosis_cases import ALIKE
from benchmarks._diagnosis_where import Located, localisation, located
from benchmarks.evidence import wilson
from palpate.mechanics.effects.registry import effect, effects

FAMILIES = {"plasticity": ("mullins_softening",)}
"""What effects that the library has never had may be taken for, as declared; 'unknown' is right as well."""
SIZES_IN_NOISE = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 1e9)
"""Edges of the detection curve: the effect's own force (best factor taken off) over the vector noise."""
FINITE = "finite_strain"
NAMES = frozenset(e.name for e in effects())


DISCOVERY = 0.05
"""Rate of false discoveries that the second baseline controls."""


@dataclass(frozen=True)
class Answer:
    """A verdict read against its case. named: effects asserted, but for those that are true of the recording
    and no question (finite strain of a neo-Hookean object, the weight of the drawn tool). first: the first
    of them, or 'none', 'unknown', 'failed'."""

    kind: str
    named: tuple[str, ...]
    candidates: tuple[str, ...]
    first: str

    @property
    def detected(self) -> bool:
        """Whether anything was said to be there."""
        return self.first not in ("none", "failed")

    @property
    def confident(self) -> bool:
        """A name without a rival or a remainder."""
        return bool(self.named) and self.kind == "effect"


def answer_of(item: dict[str, Any]) -> Answer:
    """Read a verdict."""
    case, verdict = item["case"], item["verdict"]
    named = tuple(n for n in verdict["effects"] if n not in case["beside"])
    candidates = tuple(n for n in verdict["candidates"] if n not in case["beside"])
    kind = verdict["kind"]
    if kind == "failed":
        first = "failed"
    elif named:
        first = named[0]
    else:
        first = "unknown" if "unknown" in kind else "none"
    return Answer(kind, named, candidates, first)


def discovered(verdict: dict[str, Any]) -> list[str]:
    """Effects that a search with controlled false discovery would name, the most evident first.

    As LISDD (arXiv 2606.23215) selects terms, as far as that applies: each effect of the first step by the
    chance of its held-out gain in log likelihood (Wilks), all of them by Benjamini and Hochberg (1995).
    """
    gains = {n: max(gain, 0.0) for n, (gain, _) in verdict.get("scores", {}).items() if n in NAMES}
    chance = {n: float(chi2.sf(2 * g, max(1, len(effect(n).parameters)))) for n, g in gains.items()}
    ranked = sorted(chance, key=lambda n: chance[n])
    below = [k for k, n in enumerate(ranked, 1) if chance[n] <= DISCOVERY * k / len(ranked)]
    return sorted(ranked[: max(below, default=0)], key=lambda n: -gains[n])


class _Tally:
    """Everything that is counted, case by case."""

    def __init__(self) -> None:
        self.rates: dict[str, list[bool]] = defaultdict(list)
        self.confusion: Counter[tuple[str, str]] = Counter()
        self.by_size: dict[int, list[tuple[bool, bool, bool]]] = defaultdict(list)
        self.by_effect: dict[tuple[str, float], list[tuple[bool, bool]]] = defaultdict(list)
        self.seen_from: dict[tuple[str, str], list[float]] = defaultdict(list)
        self.calibration: list[tuple[float, bool]] = []
        self.said: list[tuple[float, bool]] = []
        self.misses: list[dict[str, Any]] = []
        self.closed: list[float] = []
        self.regressed: list[float] = []
        self.sets: list[int] = []
        self.errors: list[tuple[str, float]] = []
        self.covered: list[tuple[str, bool]] = []
        self.seconds: list[float] = []

    def add(self, item: dict[str, Any]) -> None:
        """Count one opened case."""
        case, verdict, answer = item["case"], item["verdict"], answer_of(item)
        tested, kind = case["tested"], case["kind"]
        if "seconds" in verdict:
            self.seconds.append(verdict["seconds"])
        self.rates["no answer: the reconstruction or the diagnosis refused"].append(answer.first == "failed")
        excluded = case["without"]
        asked = {
            name: (p, name in case["effects"])
            for name, p in verdict.get("probability", {}).items()
            if name in case["effects"] or name not in case["beside"]
        }
        self.calibration += asked.values()
        self.said += [asked[n] for n in (*verdict["effects"], *verdict["candidates"]) if n in asked]
        size = item["truth"].get("sizes", {}).get(FINITE)
        if FINITE not in case["effects"]:
            self.rates["finite strain named on a linear object"].append(FINITE in verdict["effects"])
        elif size is not None and size["rms_after_best_scale_n"] > verdict.get("noise_n", np.inf):
            self.rates["finite strain named where it exceeds the noise"].append(FINITE in verdict["effects"])
        hit = getattr(self, "_" + kind.replace("-", "_"))(item, answer)
        if case.get("protocol"):
            self._by_protocol(case["protocol"], tested, answer)
        label = "+".join(tested) or "nothing"
        label = f"({label})" if excluded or kind == "absent" else label
        self.confusion[(label, answer.first)] += 1
        if not hit:
            self.misses.append({"case": item["key"], "verdict": answer.kind, "effects": list(answer.named),
                                "candidates": list(answer.candidates)})  # fmt: skip

    def _control(self, item: dict[str, Any], answer: Answer) -> bool:
        if answer.first == "failed":
            return False
        self.rates["false alarms (controls)"].append(answer.detected)
        self.rates["BIC baseline: false alarms (controls)"].append(
            item["verdict"].get("bic") not in (None, "none", *item["case"]["beside"])
        )
        found = [n for n in discovered(item["verdict"]) if n not in item["case"]["beside"]]
        self.rates["controlled false discovery (5 %) baseline: false alarms (controls)"].append(bool(found))
        return not answer.detected

    def _by_protocol(self, protocol: str, tested: Sequence[str], answer: Answer) -> None:
        if not tested:
            if answer.first != "failed":
                self.rates[f"{protocol} protocol: false alarms"].append(answer.detected)
        elif tested[0] in ALIKE:
            others = set(ALIKE) - set(tested)
            apart = tested[0] in answer.named and not others & {*answer.named, *answer.candidates}
            self.rates[f"{protocol} protocol: delay, play and viscoelasticity told apart"].append(apart)
        else:
            words = tested[0].replace("_", " ")
            self.rates[f"{protocol} protocol: {words} found"].append(tested[0] in answer.named)

    def _single(self, item: dict[str, Any], answer: Answer) -> bool:
        verdict, (name,) = item["verdict"], item["case"]["tested"]
        strength = item["case"]["effects"][name]
        hit = answer.first == name
        either = name in answer.named or name in answer.candidates
        size = size_in_noise(item, name)
        self.by_size[int(np.searchsorted(SIZES_IN_NOISE, size, side="right") - 1)].append(
            (answer.detected, hit, either)
        )
        self.by_effect[(name, strength)].append((answer.detected, hit))
        if size >= 2:
            self.rates["detected, effect at least twice the noise"].append(answer.detected)
        seen = size_in_limits(item, name)
        if seen > 0:
            self.seen_from[(name, item["case"].get("protocol", ""))].append(strength / seen)
        if seen >= 2:
            self.rates["detected, effect at least twice what can be seen"].append(answer.detected)
        if seen >= 4:
            self.rates["first place, effect at least 4 times what can be seen"].append(hit)
            self.rates["first place or declared equal, at least 4 times what can be seen"].append(either)
        if seen < 1:
            self.rates["effect too small to be seen: named all the same"].append(hit)
        if size >= 4:
            self.rates["first place, effect at least 4 times the noise"].append(hit)
            self.rates["first place or declared equal, at least 4 times the noise"].append(either)
        self.rates["first place, all sizes"].append(hit)
        self.rates["confidently wrong (a name, no rival, truth not in it)"].append(
            answer.confident and not either
        )
        self.rates["answered unknown, nothing named"].append(answer.first == "unknown")
        if answer.detected:
            self.rates["truth in the candidate set (where detected)"].append(either)
            self.sets.append(len(set(answer.named) | set(answer.candidates)))
        self.rates["BIC baseline: first place"].append(verdict.get("bic") == name)
        first = next((n for n in discovered(verdict) if n not in item["case"]["beside"]), None)
        self.rates["controlled false discovery (5 %) baseline: first place"].append(first == name)
        if name in answer.named:
            self._parameters(item, name)
        if hit and verdict.get("gap_closed") is not None:
            self.closed.append(verdict["gap_closed"])
            excess = verdict["gap_before_n"] ** 2 - verdict["noise_n"] ** 2
            left = verdict["regression_gap_n"] ** 2 - verdict["noise_n"] ** 2
            self.regressed.append(1 - left / excess if excess > 0 else np.nan)
        return hit

    def _left_out(self, item: dict[str, Any], answer: Answer) -> bool:
        hit = "unknown" in answer.kind or answer.kind == "ambiguous"
        self.rates["left out of the library: unknown or ambiguous"].append(hit)
        self.rates["left out of the library: confidently another name"].append(answer.confident)
        return hit

    def _absent(self, item: dict[str, Any], answer: Answer) -> bool:
        allowed = FAMILIES.get(item["case"]["tested"][0], ())
        hit = "unknown" in answer.kind or answer.kind == "ambiguous" or answer.first in allowed
        self.rates["absent effect: unknown, ambiguous or its declared family"].append(hit)
        return hit

    def _pair(self, item: dict[str, Any], answer: Answer) -> bool:
        pair = item["case"]["tested"]
        sizes = item["truth"].get("sizes", {})
        main = max(pair, key=lambda n: sizes.get(n, {}).get("rms_after_best_scale_n", 0.0))
        hit = set(pair) <= set(answer.named)
        self.rates["pair: both named"].append(hit)
        self.rates["pair: the dominant one named"].append(main in answer.named)
        return hit

    def _parameters(self, item: dict[str, Any], name: str) -> None:
        """Relative error, and whether the interval covers, of every parameter that both state."""
        true = item["truth"].get("parameters", {}).get(name, {})
        intervals = item["verdict"].get("intervals", {}).get(name, {})
        for key, value in item["verdict"]["parameters"].get(name, {}).items():
            if key not in true or isinstance(value, bool) or isinstance(true[key], str):
                continue
            a, b = np.atleast_1d(np.asarray(value, float)), np.atleast_1d(np.asarray(true[key], float))
            if key == "g":
                a, b = a.sum(keepdims=True), b.sum(keepdims=True)
            if a.shape == b.shape and np.linalg.norm(b) > 0:
                self.errors.append((f"{name}.{key}", float(np.linalg.norm(a - b) / np.linalg.norm(b))))
                if key in intervals:
                    low, high = (np.asarray(x, float).ravel() for x in intervals[key])
                    if low.shape == b.ravel().shape:
                        inside = (low <= b.ravel()) & (b.ravel() <= high)
                        self.covered += [(f"{name}.{key}", bool(x)) for x in inside]


def summarise(done: list[dict[str, Any]]) -> dict[str, Any]:
    """Everything the tables and pictures show, of opened cases (key, case, verdict, truth)."""
    tally = _Tally()
    for item in done:
        tally.add(item)
    covered = tally.covered
    return {
        "rates": {k: rate(v) for k, v in tally.rates.items()},
        "detection_by_size": [
            {"from": SIZES_IN_NOISE[i], "to": SIZES_IN_NOISE[i + 1],
             **{k: rate([x[j] for x in v]) for j, k in enumerate(("detected", "named_first", "in_set"))}}
            for i, v in sorted(tally.by_size.items())
        ],
        "by_effect": [
            {"effect": n, "strength": s, "of": len(v), "detected": sum(d for d, _ in v),
             "first": sum(h for _, h in v)}
            for (n, s), v in sorted(tally.by_effect.items())
        ],
        "seen_from": [
            {"effect": n, "protocol": p, "of": len(v), "median": float(np.median(v)),
             "least": min(v), "most": max(v)}
            for (n, p), v in sorted(tally.seen_from.items())
        ],
        "confusion": [[a, b, n] for (a, b), n in sorted(tally.confusion.items())],
        "median_gap_closed": _median(tally.closed),
        "median_gap_closed_by_regression": _median(tally.regressed),
        "median_parameter_error": _median([e for _, e in tally.errors]),
        "parameter_errors": _by_key(tally.errors),
        "parameter_coverage": rate([c for _, c in covered]),
        "parameter_coverage_by_key": {k: [int(sum(v)), len(v)] for k, v in _grouped(covered).items()},
        "mean_candidates": float(np.mean(tally.sets)) if tally.sets else None,
        "calibration": calibration(tally.calibration),
        "calibration_of_said": calibration(tally.said),
        "median_seconds": _median(tally.seconds),
        "localisation": localisation([bins for bins in map(_located, done) if bins is not None]),
        "misses": tally.misses,
    }  # fmt: skip


def rate(hits: list[bool]) -> dict[str, Any]:
    """Counts with Wilson's interval."""
    return {"hits": int(sum(hits)), "of": len(hits), "rate_and_interval": wilson(sum(hits), len(hits))}


def size_in_noise(item: dict[str, Any], name: str) -> float:
    """The effect's rms force, a common factor taken off, over the vector noise; nan where not told."""
    about = item["truth"].get("sizes", {}).get(name, {})
    value = about.get("rms_after_best_scale_n", about.get("rms_n", np.nan))
    return float(value) / (np.sqrt(3) * item["truth"]["noise_rms_n"])


def size_in_limits(item: dict[str, Any], name: str) -> float:
    """The effect's rms force, a common factor taken off, over the smallest that these presses show; nan where
    that is not told (readings that free air or the support settle)."""
    about = item["truth"].get("sizes", {}).get(name, {})
    limit = item["verdict"].get("detectable_n", {}).get(name)
    return float(about.get("rms_after_best_scale_n", np.nan)) / limit if limit else float("nan")


def _located(item: dict[str, Any]) -> Located | None:
    """The case's bins where an effect that is asked for can be told: it is at least twice what can be seen,
    or twice the noise where the library does not have it and states no limit."""
    case = item["case"]
    gone = case["kind"] == "absent" or bool(case["without"])
    told = [size_in_limits(item, n) >= 2 or (gone and size_in_noise(item, n) >= 2) for n in case["tested"]]
    return located(item) if any(told) else None


def _median(values: list[float]) -> float | None:
    return float(np.nanmedian(values)) if len(values) else None


def _grouped(pairs: list[tuple[str, Any]]) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = defaultdict(list)
    for key, value in pairs:
        found[key].append(value)
    return dict(sorted(found.items()))


def _by_key(errors: list[tuple[str, float]]) -> dict[str, dict[str, float]]:
    return {k: {"median": float(np.median(v)), "of": len(v)} for k, v in _grouped(errors).items()}


def calibration(pairs: list[tuple[float, bool]]) -> dict[str, Any]:
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
