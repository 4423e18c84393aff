"""Does the touch that a diagnosis proposes settle what it left open?

Of the blind benchmark's judged cases those whose verdict left rivals or a remainder are diagnosed once more,
and what that proposes is done: the laboratory explores the same object by the same hand, and makes the
proposed press last, at the nearest place that is solved; or presses the bare support, waves and traces the
base once more, where that is proposed. The longer recording is reconstructed and diagnosed like any other.
Counted are answers that are right and leave nothing open, before and after, and after one more press at a
place by chance, made as the others were.
"""

from __future__ import annotations

import argparse
import tempfile
from concurrent.futures import as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks._diagnosis_blind import opened_case, verdict_path
from benchmarks._diagnosis_cases import POOLS, SEEDS, Case, cases
from benchmarks._diagnosis_scores import answer_of
from benchmarks.evidence import wilson
from benchmarks.timing import table
from benchmarks.varied.objects import Thing, thing
from benchmarks.varied.recorded import explored, frame
from benchmarks.varied.writing import write
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.diagnosis.verdict.result import Diagnosis, NextTouch
from palpate.mechanics.errors import PalpateError
from palpate.mechanics.model.files import read_model
from palpate.mechanics.recording.recording import read_recording
from palpate.output import progress_bar
from palpate.reconstruction.pipeline import reconstruct
from palpate.scenes.laboratory.curves import Solving, workers_of_ours
from palpate.scenes.laboratory.presses import Touch

WAYS = ("proposed", "by chance")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Whose verdicts, and how many."""
    parser.add_argument("--work", required=True, help="work folder of `palpate bench diagnose`")
    parser.add_argument("--size", choices=tuple(POOLS), default="medium", help="of its cases")
    parser.add_argument("--cases", choices=tuple(SEEDS), default="development", help="whose seeds")
    parser.add_argument("--seed", type=int, help="first seed, instead of that of --cases")
    parser.add_argument("--limit", type=int, help="at most so many of those left open")
    parser.add_argument("--workers", type=int, default=1, help="processes (default: 1)")
    parser.add_argument("--fast", action="store_true", help="diagnose with --fast")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Play every case that was left open; print what became of each, and the counts."""
    work = Path(arguments.work)
    first = SEEDS[arguments.cases] if arguments.seed is None else arguments.seed
    judged = [c for c in cases(arguments.size, None, first) if verdict_path(c, work).exists()]
    todo = [c for c in judged if is_open(c, work)][: arguments.limit]
    rows: list[dict[str, Any]] = []
    with progress_bar("touches") as progress, workers_of_ours(arguments.workers) as pool:
        waiting = [pool.submit(played, case, work, arguments.fast) for case in todo]
        for done, future in enumerate(as_completed(waiting)):
            row = future.result()
            rows += [] if row is None else [row]
            progress("touches", (done + 1) / len(waiting))
    rows.sort(key=lambda r: str(r["case"]))
    print(table(["case", "left open", "proposed", *WAYS], [
        [r["case"], r["before"]["words"], r["kind"], *(r[way]["words"] for way in WAYS)] for r in rows
    ]))  # fmt: skip
    figures: dict[str, Any] = {"judged": len(judged), "open": len(todo), "played": rows}
    for way in ("before", *WAYS):
        settled = sum(r[way]["settled"] for r in rows)
        share, low, high = wilson(settled, len(rows))
        print(f"{way}: right and nothing open {settled}/{len(rows)} ({low:.0%} to {high:.0%})")
        figures[way] = [settled, len(rows), share]
    return figures


def is_open(case: Case, work: Path) -> bool:
    """Whether the verdict of a case that can be settled leaves rivals or a remainder."""
    verdict = opened_case(case, work)["verdict"]
    return case.kind in ("control", "single", "pair") and (
        verdict["kind"] == "ambiguous" or "unknown" in verdict["kind"]
    )


def played(case: Case, work: Path, fast: bool) -> dict[str, Any] | None:
    """What becomes of a case with what is proposed, and with a press by chance; None where the program says
    something that is settled by now."""
    options = DiagnoseOptions(fast=fast)
    recording = read_recording(work / f"{case.recording}.csv.gz")
    before = diagnose(recording, read_model(work / "models" / case.recording), options)
    if before.next_touch is None or not before.unsettled:
        return None
    rng = np.random.default_rng([37, case.seed])
    it = thing(case.number)
    beside = before.next_touch.kind != "press"
    extra = [] if beside else [_touch(case, it, before.next_touch)]
    chance = replace(it.places[int(rng.integers(len(it.places)))][0], speed=None, hold=None)
    return {
        "case": case.key,
        "kind": before.next_touch.kind,
        "before": _said(case, before),
        "proposed": _done(case, work, extra, beside, options),
        "by chance": _done(case, work, [chance], False, options),
    }


def _touch(case: Case, it: Thing, wanted: NextTouch) -> Touch:
    """The proposed press at the nearest solved place; dragged or oblique where that was asked for and is
    solved."""
    turn, shift = frame(case.nuisances)
    point = 1e3 * ((np.array([wanted.x, wanted.y, wanted.z]) - shift) @ turn)
    way = np.array(wanted.direction) @ turn
    kinds = min(it.places, key=lambda place: float(np.linalg.norm(place[0].point - point)))
    aside = np.linalg.norm(way + (way @ -kinds[0].normal) * kinds[0].normal) > 0.1
    touch = kinds[-1] if aside else kinds[0]
    if touch.kind == "drag":
        return touch
    depth = float(np.clip(1e3 * wanted.depth_m, 0.5, touch.reach))
    return replace(touch, depth=depth, speed=1e3 * wanted.speed_m_per_s, hold=wanted.hold_s)


def _done(
    case: Case, work: Path, extra: list[Touch], beside: bool, options: DiagnoseOptions
) -> dict[str, Any]:
    """Explore, reconstruct and diagnose again with more touches, or by the complete protocol."""
    drawn = replace(case.nuisances, ends_in_contact=False)
    made = explored(
        drawn, case.effects, complete=beside or case.protocol == "complete", more=extra,
        solving=Solving(workers=1, cache=work / "touches"),
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        recording = read_recording(write(Path(folder) / "more.csv.gz", made.recording, drawn))
    try:
        return _said(case, diagnose(recording, reconstruct(recording), options))
    except PalpateError as error:
        return {"words": f"refused: {error}", "settled": False}


def _said(case: Case, told: Diagnosis) -> dict[str, Any]:
    """The verdict in words, and whether it is right and leaves nothing open."""
    answer = answer_of({"case": case.as_json(), "verdict": told.as_json()["verdict"]})
    named = " and ".join(answer.named) or answer.first
    rivals = f" or {', '.join(answer.candidates)}" if answer.candidates else ""
    rest = " and a remainder" if "unknown" in answer.kind and answer.named else ""
    right = set(answer.named) == set(case.tested) and not answer.candidates and "unknown" not in answer.kind
    return {"words": named + rivals + rest, "settled": bool(right)}
