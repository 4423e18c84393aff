"""Is every exploration understood? Drawn objects, hands, instruments and writing, reconstructed.

Each seed draws one exploration (scenes.variety); the virtual laboratory answers for its forces. Told are the
share that is reconstructed, the error of the modulus, the coverage of its interval, the distance of the
surface, and the presses that were found, by each nuisance; with --diagnose also how many of these sound
objects the diagnosis calls sound. What was recorded and reconstructed before by the same program is read, not
done again: a run that was interrupted goes on.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import time
from collections.abc import Callable, Sequence
from concurrent.futures import as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._diagnosis_cases import WEIGHT
from benchmarks._diagnosis_scores import answer_of
from benchmarks._surface_truth import Truth
from benchmarks.evidence import Figure, rates, wilson
from benchmarks.surface import deviation
from benchmarks.timing import table
from benchmarks.varied.draws import Draw, draw
from benchmarks.varied.objects import solved, thing
from benchmarks.varied.recorded import Varied, record
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.disk.scratch import cache_folder
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.model import Model
from palpate.output import progress_bar
from palpate.reconstruction.pipeline import reconstruct_fully
from palpate.scenes.laboratory.curves import workers_of_ours

ROOMS = ("mechanics", "reconstruct")
_WITHIN_S = 0.15
"""A press is found where a first touch is told within a true touch, or this close to it."""

_DEVELOPMENT = 150
"""Draws below this seed were looked at while the program was mended, those from it on were not."""

NUISANCES: dict[str, Callable[[Draw], str]] = {
    "seed": lambda d: "development" if d.seed < _DEVELOPMENT else "evaluation",
    "modulus": lambda d: _band(d.young_modulus_pa / 1e3, (12, 40), "kPa"),
    "phase": lambda d: "stated" if d.boundary_phase_stated else "not stated",
    "rate": lambda d: f"{d.rate_hz:g} Hz",
    "jitter": lambda d: "jitter" if d.jitter else "even",
    "lost": lambda d: "samples lost" if d.lost_share else "none lost",
    "force on": lambda d: "object" if d.force_on_object else "tool",
    "orientation": lambda d: d.orientation,
    "tool": lambda d: "no mass" if d.tool_mass_kg == 0 else _band(1e3 * d.tool_mass_kg, (50,), "g"),
    "tared": lambda d: "tared" if d.tared else "not tared",
    "noise": lambda d: _band(1e3 * d.noise_n, (10, 20), "mN"),
    "presses": lambda d: _band(d.presses, (20, 36), "presses"),
    "repeats": lambda d: _band(100 * d.repeat_share, (30,), "% repeats"),
    "places": lambda d: f"{d.clusters} heaps" if d.clusters else "even",
    "depth": lambda d: _band(1e3 * d.most_depth_m, (3, 6), "mm deepest"),
    "pace": lambda d: _band(d.pace, (1,), "pace"),
    "air": lambda d: _band(d.briskness, (1,), "brisk"),
    "begins": lambda d: "in contact" if d.begins_in_contact else "in air",
    "ends": lambda d: "in contact" if d.ends_in_contact else "in air",
    "tracing": lambda d: d.tracing,
    "object": lambda d: thing(d.number).phantom.name.rsplit("-", 1)[0],
}
"""Nuisance: the group that a draw belongs to."""

REMEDIES: dict[str, Callable[[Draw], Draw]] = {
    "log the tool's orientation": lambda d: replace(d, orientation="given"),
    "press deeper": lambda d: replace(
        d, least_depth_m=min(2 * d.least_depth_m, 0.01), most_depth_m=min(2 * d.most_depth_m, 0.01)
    ),
    "trace the whole base": lambda d: replace(d, tracing="two", begins_in_contact=False),
    "more places": lambda d: replace(d, presses=max(2 * d.presses, 30), repeat_share=0.05, clusters=0),
}
"""Words of a refusal that tell what to do: the same exploration, had it been done."""


def _band(value: float, cuts: tuple[float, ...], unit: str) -> str:
    at = int(np.searchsorted(cuts, value))
    if at == 0:
        return f"below {cuts[0]:g} {unit}"
    return f"above {cuts[-1]:g} {unit}" if at == len(cuts) else f"{cuts[at - 1]:g} to {cuts[at]:g} {unit}"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many, where, and whether objects may be solved."""
    parser.add_argument("--count", type=int, default=300, help="recordings (default: 300)")
    parser.add_argument("--first", type=int, default=0, help="first seed (default: 0)")
    parser.add_argument("--work", type=Path, help="folder of recordings and answers (default: in the cache)")
    parser.add_argument("--workers", type=int, default=1, help="processes (default: 1)")
    parser.add_argument(
        "--solved-only", action="store_true", help="only objects whose touches are solved already"
    )
    parser.add_argument("--effect", help="an effect of strength 1 in all of them")
    parser.add_argument(
        "--diagnose", action="store_true", help="diagnose what is reconstructed, with default options"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Record and reconstruct what is missing; print the table and every miss; returns all answers."""
    work = arguments.work or cache_folder() / "variety"
    seeds = range(arguments.first, arguments.first + arguments.count)
    chosen = [s for s in seeds if not arguments.solved_only or solved(draw(s).number)]
    keys, answers = (program_key(ROOMS), program_key((*ROOMS, "diagnose"))), []
    with progress_bar("explorations") as progress, workers_of_ours(arguments.workers) as pool:
        waiting = [pool.submit(answered, s, work, keys, arguments.effect, arguments.diagnose) for s in chosen]
        for done, future in enumerate(as_completed(waiting)):
            answers.append(future.result())
            progress("explorations", (done + 1) / len(waiting))
    answers.sort(key=lambda a: a["seed"])
    return {"program": keys[arguments.diagnose], "explorations": answers, **report(answers)}


def program_key(rooms: Sequence[str]) -> str:
    """A key of the program text that an answer depends on."""
    root, digest = Path(__file__).parents[1], hashlib.sha256()
    for room in rooms:
        for path in sorted((root / room).rglob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def answered(
    seed: int, work: Path, keys: tuple[str, str], effect: str | None = None, judged: bool = False
) -> dict[str, Any]:
    """The answer to one draw, read where the same program gave it to the same recording; one that was
    diagnosed as well serves both. keys: of the program without the diagnosis and with it. judged: diagnose.
    """
    folder = work / "recordings"
    folder.mkdir(parents=True, exist_ok=True)
    effects = {effect: 1.0} if effect else {}
    varied = record(draw(seed), folder, effects)
    name = f"{varied.recording.name}-{varied.recording.content[:12]}"
    plain, diagnosed = (work / "answers" / f"{name}-{key}.json" for key in keys)
    path = diagnosed if judged else plain
    for known in (diagnosed, path):
        if known.is_file():
            found: dict[str, Any] = json.loads(known.read_text(encoding="utf-8"))
            return found
    answer = {"seed": seed, "truth": _truth(varied), **_reconstructed(varied, judged)}
    if "refused" in answer:
        answer["remedies"] = _tried(draw(seed), answer["refused"], work / "mended", effects)
    path.parent.mkdir(exist_ok=True)
    with atomic_file(path) as temporary:
        temporary.write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
    return answer


def _tried(drawn: Draw, refusal: str, folder: Path, effects: dict[str, float]) -> dict[str, dict[str, Any]]:
    """What becomes of the same exploration with each remedy that the refusal names, and with all of them."""
    folder.mkdir(parents=True, exist_ok=True)
    named = [words for words in REMEDIES if words in refusal]
    ways = {words: [words] for words in named} | ({"all of them": named} if len(named) > 1 else {})
    tried = {}
    for name, steps in ways.items():
        mended = drawn
        for words in steps:
            mended = REMEDIES[words](mended)
        tried[name] = _reconstructed(record(mended, folder, effects))
    return tried


def touched_s(varied: Varied) -> np.ndarray:
    """(k, 2) s: first and last touch of every true press that begins within the recording, on its clock."""
    way, drawn = varied.simulation.motion, varied.draw
    rows = [way.t[(way.touch == k) & (way.s > 0)] for k in range(way.touch.max() + 1)]
    times = np.array([(r[0], r[-1]) for r in rows if len(r)]) + drawn.clock_s
    return times[(times[:, 0] > varied.recording.t[0]) & (times[:, 0] < varied.recording.t[-1])]


def _truth(varied: Varied) -> dict[str, Any]:
    force, way = varied.simulation.clean_n, varied.simulation.motion
    peaks = []
    for k in range(way.touch.max() + 1):
        rows = np.flatnonzero((way.touch == k) & (way.s > 0))
        # above what the tool weighs
        peaks.append(float(np.linalg.norm(force[rows] - force[rows[0]], axis=1).max()))
    return {
        "object": varied.thing.phantom.name,
        "young_modulus_pa": varied.draw.young_modulus_pa,
        "presses": len(touched_s(varied)),
        "median_peak_n": float(np.median(peaks)),
    }


def _reconstructed(varied: Varied, judged: bool = False) -> dict[str, Any]:
    start = time.process_time()
    try:
        result = reconstruct_fully(varied.recording)
    except PalpateError as error:
        return {"refused": str(error), "cpu_s": time.process_time() - start}
    except Exception as error:  # a crash is an answer too, and the worst
        return {"crashed": f"{type(error).__name__}: {error}", "cpu_s": time.process_time() - start}
    presses, material = result.exploration.presses, result.model.material
    true, told = touched_s(varied), presses.onset_s
    within = (told[:, None] > true[:, 0] - _WITHIN_S) & (told[:, None] < true[:, 1] + _WITHIN_S)
    low, high = material.young_modulus_ci95_pa
    modulus = varied.draw.young_modulus_pa
    turned = np.array(varied.simulation.truth["device_from_object_rotation"])
    shift = np.array(varied.simulation.truth["device_from_object_shift_mm"]) / 1e3
    phantom = varied.thing.phantom
    shape = Truth(phantom.name, phantom.vertices, phantom.faces)
    return {
        "young_modulus_pa": material.young_modulus_pa,
        "ci95_pa": [low, high],
        "error": material.young_modulus_pa / modulus - 1,
        "covers": bool(low <= modulus <= high),
        "found": int(within.any(axis=0).sum()),
        "false": int((~within.any(axis=1)).sum()),
        "left_out": [[float(t), reason] for t, reason in result.exploration.rejected],
        "surface": result.surface.method,
        "delay_s": result.exploration.delay_s,
        **deviation(shape, (result.surface.vertices - shift) @ turned, result.surface.triangles),
        "cpu_s": time.process_time() - start,
        **({"verdict": _verdict(varied, result.model)} if judged else {}),
    }


def _verdict(varied: Varied, model: Model) -> dict[str, Any]:
    """What the diagnosis says; a reason where it refuses."""
    start = time.process_time()
    try:
        told = diagnose(varied.recording, model).as_json()
    except PalpateError as error:
        return {"kind": "failed", "effects": [], "candidates": [], "why": str(error)}
    return {
        **told["verdict"],
        **{key: told[key] for key in ("gap_before_n", "gap_after_n", "noise_n", "reasons")},
        "cpu_s": time.process_time() - start,
    }


def _first(answer: dict[str, Any]) -> str | None:
    """The first that the diagnosis named, 'none', 'unknown' or 'failed'; a tool's own weight is no news.
    None where nothing was diagnosed."""
    if "verdict" not in answer:
        return None
    heavy = draw(answer["seed"]).tool_mass_kg > 0
    return answer_of({"case": {"beside": WEIGHT if heavy else ()}, "verdict": answer["verdict"]}).first


_HEADER = ["nuisance", "group", "recordings", "reconstructed", "refused", "mended", "crashed", "within 5 %",
           "within 10 %", "covered", "median error %", "median surface mm", "presses found",
           "called sound"]  # fmt: skip


def report(answers: list[dict[str, Any]]) -> dict[str, Any]:
    """Print the table of all and of each nuisance's groups, and the misses; returns the figures."""
    groups = [("all", "all", answers)]
    for name, group in NUISANCES.items():
        kinds: dict[str, list[dict[str, Any]]] = {}
        for answer in answers:
            kinds.setdefault(group(draw(answer["seed"])), []).append(answer)
        groups += [(name, kind, kinds[kind]) for kind in sorted(kinds)]
    rows, figures = [], {}
    for name, kind, members in groups:
        figure = _figures(members)
        figures[f"{name}: {kind}"] = figure
        rows.append([name, kind, *figure["row"]])
    print(table(_HEADER, rows))
    print()
    for answer in answers:
        named = _first(answer) not in (None, "none")
        if "error" not in answer or abs(answer["error"]) > 0.1 or not answer["covers"] or named:
            print(_miss(answer))
    return {"groups": figures, "figures": _kept(answers)}


def _kept(answers: list[dict[str, Any]]) -> list[Figure]:
    """Of all explorations."""
    all_of = _figures(answers)
    done, of = all_of["reconstructed"], all_of["recordings"]
    counted = {
        "explorations reconstructed": (done, of),
        "modulus within 5 %": (all_of["within_5"], done),
        "modulus within 10 %": (all_of["within_10"], done),
        "interval holds the modulus": (all_of["covered"], done),
        "sound objects without a false alarm": (all_of["sound"], all_of["diagnosed"]),
    }
    error = [100 * abs(a["error"]) for a in answers if "error" in a]
    if not error:
        return rates(counted)
    middle = (float(np.quantile(error, 0.25)), float(np.quantile(error, 0.75)))
    what = "error of the modulus, median (middle half)"
    return [*rates(counted), Figure(what, float(np.median(error)), middle, "%")]


def _figures(members: list[dict[str, Any]]) -> dict[str, Any]:
    done = [a for a in members if "error" in a]
    error = np.abs([a["error"] for a in done]) if done else np.full(1, np.nan)
    close, near = int((error < 0.05).sum()), int((error < 0.10).sum())
    covered = sum(a["covers"] for a in done)
    refused, crashed = (sum(k in a for a in members) for k in ("refused", "crashed"))
    mended = sum(_mended(a) for a in members)
    found = sum(a["found"] for a in done) / max(1, sum(a["truth"]["presses"] for a in done))
    surface = float(np.median([1e3 * a["mean_m"] for a in done])) if done else float("nan")
    firsts = [first for first in map(_first, done) if first not in (None, "failed")]
    sound = firsts.count("none")
    return {
        "recordings": len(members), "reconstructed": len(done), "refused": refused, "mended": mended,
        "crashed": crashed,
        "within_5": close, "within_10": near, "covered": covered, "covered95": wilson(covered, len(done)),
        "diagnosed": len(firsts), "sound": sound, "sound95": wilson(sound, len(firsts)),
        "row": [len(members), len(done), refused, mended, crashed, close, near, covered,
                f"{100 * np.median(error):.1f}", f"{surface:.2f}", f"{100 * found:.0f} %",
                f"{sound} of {len(firsts)}" if firsts else ""],
    }  # fmt: skip


def _mended(answer: dict[str, Any]) -> bool:
    """Whether a refused exploration is reconstructed once all that its refusal says is done."""
    return "error" in list(answer.get("remedies", {}).values() or [{}])[-1]


def _miss(answer: dict[str, Any]) -> str:
    truth = answer["truth"]
    what = f"seed {answer['seed']}, {truth['object']}, {truth['young_modulus_pa'] / 1e3:.1f} kPa, "
    what += f"{truth['presses']} presses of {truth['median_peak_n']:.3g} N in the middle: "
    if "error" not in answer:
        what += answer.get("refused") or "CRASHED " + answer["crashed"]
        for words, tried in answer.get("remedies", {}).items():
            then = f"{100 * tried['error']:+.1f} %" if "error" in tried else tried.get("refused", "CRASHED")
            what += f"\n    after '{words}': {then}"
        return what
    low, high = (v / 1e3 for v in answer["ci95_pa"])
    return what + (
        f"{100 * answer['error']:+.1f} %, interval {low:.1f} to {high:.1f} kPa, {answer['found']} presses "
        f"found, {answer['false']} false, {answer['surface']} off by {1e3 * answer['mean_m']:.2f} mm"
        + ("" if (first := _first(answer)) in (None, "none") else f"; diagnosed: {first}")
    )
