"""A case as tasks: its object's touches solved (shared between cases), sealed recording and model,
verdict. Everything lies in one work folder, which all workers must see; then the truth is opened.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

from benchmarks._diagnosis_cases import FINITE, Case
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.errors import PalpateError
from palpate.parallel.tasks import Task, finished
from palpate.scenes.laboratory.specimen import VERSION

_HERE = "benchmarks._diagnosis_blind"
_MEMORY = {"solve": 600_000_000, "prepare": 700_000_000, "judge": 900_000_000}
"""Before any is measured."""


class NotSolved(PalpateError):
    """The touches of a case would have to be solved first."""


def tasks_of(case: Case, work: Path, *, solve: bool, fast: bool) -> list[Task]:
    """Solve what the object's cases share (where touches may be solved at all), prepare, judge."""
    work = work.resolve()
    own = []
    if solve:
        # an effect's size is told against what is left without it
        for finite in (False, True) if FINITE in case.effects else (False,):
            label = f"{case.number}-{'neo-hookean' if finite else 'linear'}"
            own.append(_task("solve", label, {"number": case.number, "finite": finite}, work, ()))
    needs = tuple(task.name for task in own)
    own.append(_task("prepare", case.recording, {"case": _of(case, ""), "solve": solve}, work, needs))
    judged = {"case": _of(case, case.without), "fast": fast}
    own.append(_task("judge", case.key, judged, work, (own[-1].name,)))
    return own


def _of(case: Case, without: str) -> dict[str, Any]:
    """What the work on a case depends on, which is not what is asked."""
    return {"number": case.number, "seed": case.seed, "effects": dict(case.effects), "kind": case.kind,
            "tested": list(case.tested), "without": without,
            **({"protocol": case.protocol} if case.protocol else {})}  # fmt: skip


def _task(stage: str, label: str, content: dict[str, Any], work: Path, needs: tuple[str, ...]) -> Task:
    return Task(
        f"{_HERE}:{stage}", {**content, "laboratory": VERSION}, work / "tasks" / stage / f"{label}.json",
        places={"work": str(work)}, needs=needs, stage=stage, label=label, memory_bytes=_MEMORY[stage],
    )  # fmt: skip


def unfinished(task: Task) -> bool:
    """Whether its record is missing or of other content; what its needs gave is not looked at."""
    try:
        needs = json.loads(task.record.read_text(encoding="utf-8"))["needs"]
    except (OSError, ValueError, KeyError):
        return True
    return finished(task, needs) is None


def solve(number: int, finite: bool, work: str, laboratory: int) -> dict[str, Any]:
    """Solve every touch of an object without effects, linear or neo-Hookean, and keep them in the work
    folder.
    """
    from benchmarks.varied.objects import FINENESS, specimen, thing
    from palpate.scenes.laboratory.curves import Solving
    from palpate.scenes.laboratory.paths import touch_forces

    it = thing(number)
    touches = [touch for place in it.places for touch in place]
    solid = replace(specimen(it), finite=finite)
    solving = Solving(workers=1, cache=_touches(Path(work)), fineness=FINENESS)
    touch_forces(it.phantom, solid, touches, solving)
    return {"touches": len(touches)}


def _touches(work: Path) -> Path:
    return work / "touches"


def prepare(case: dict[str, Any], solve: bool, work: str, laboratory: int) -> dict[str, Any]:
    """Explore with the truth sealed, and reconstruct; what cannot be reconstructed is noted with its reason.

    Raises NotSolved where touches would have to be solved and `solve` does not allow for it.
    """
    from palpate.mechanics.model.files import write_model
    from palpate.mechanics.recording.recording import read_recording
    from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct

    this, at = _case(case), Path(work)
    for folder in ("truth", "models", "verdicts"):
        (at / folder).mkdir(parents=True, exist_ok=True)
    samples = _samples(this, at)
    _explore(this, at, samples, solve)
    failure = _failure(this, at)
    failure.unlink(missing_ok=True)
    try:
        model = reconstruct(read_recording(samples), ReconstructOptions())
    except PalpateError as error:
        failure.write_text(f"{error}\n", encoding="utf-8")
        return {"refused": str(error)}
    write_model(at / "models" / this.recording, model)
    return {"modulus_pa": model.material.young_modulus_pa}


def _case(case: dict[str, Any]) -> Case:
    return Case(**{**case, "tested": tuple(case["tested"])})


def _samples(case: Case, work: Path) -> Path:
    return work / f"{case.recording}.csv.gz"


def _failure(case: Case, work: Path) -> Path:
    return work / "models" / f"{case.recording}.failed"


def _explore(case: Case, work: Path, samples: Path, solve: bool) -> None:
    from benchmarks.varied.recorded import explored
    from benchmarks.varied.writing import write
    from palpate.scenes.laboratory.curves import Solving
    from palpate.scenes.laboratory.sealing import write_sealed

    def refuse(label: str, share: float) -> None:
        if not solve:
            raise NotSolved(f"the laboratory would have to solve touches ({label}): run with --solve")

    drawn = case.nuisances
    made = explored(
        drawn, case.effects, sizes=True, complete=case.protocol == "complete",
        solving=Solving(workers=1, cache=_touches(work), progress=refuse),
    )  # fmt: skip
    truth = {**made.simulation.truth, "nuisances": drawn.table()}
    name = made.recording.object_name
    write_sealed(
        samples, made.recording, truth, work / "truth" / f"{case.recording}.json",
        lambda path, recording: write(path, replace(recording, object_name=name), drawn),
    )  # fmt: skip


def verdict_path(case: Case, work: Path) -> Path:
    """Where the answer is written."""
    return work / "verdicts" / f"{case.key}.json"


def judge(case: dict[str, Any], fast: bool, work: str, laboratory: int) -> dict[str, Any]:
    """Diagnose; the truth stays shut. Errors are a verdict too. The answer is written."""
    from benchmarks._baselines import best_by_bic, regressed_gap
    from palpate.diagnosis.options import DiagnoseOptions
    from palpate.diagnosis.pipeline import diagnose
    from palpate.diagnosis.verdict.conclusion import factors
    from palpate.mechanics.model.files import read_model
    from palpate.mechanics.recording.recording import read_recording

    this, at = _case(case), Path(work)
    answer: dict[str, Any]
    try:
        if _failure(this, at).exists():
            raise PalpateError(_failure(this, at).read_text(encoding="utf-8").strip())
        recording = read_recording(_samples(this, at))
        model = read_model(at / "models" / this.recording)
        result = diagnose(recording, model, DiagnoseOptions(fast=fast, without=this.without))
    except PalpateError as error:
        answer = {"kind": "failed", "effects": [], "candidates": [], "why": str(error)}
    else:
        data = result.as_json()
        assert result.attribution is not None and result.forward is not None
        assert result.residual_before is not None
        answer = {
            **data["verdict"],
            **{k: data[k] for k in ("gap_before_n", "gap_after_n", "gap_closed", "gap_closed_ci95", "noise_n",
                                    "young_modulus_pa", "reasons")},
            "parameters": {e["name"]: e["parameters"] for e in data["effects"]},
            "intervals": {e["name"]: e.get("parameters_ci95", {}) for e in data["effects"]},
            "closed_by": {e["name"]: e["gap_closed"] for e in data["effects"]},
            "probability": {e["name"]: e["probability"] for e in data["effects"]},
            "widening": dict(factors()),
            "detectable_n": {e["name"]: e["detectable_n"] for e in data["effects"]},
            "scores": {n: [s.evidence, s.foretold] for n, s in result.attribution.scores.items()},
            "picked": list(result.attribution.picked),
            "later_scores": [
                {n: [s.evidence, s.foretold] for n, s in step.items()}
                for step in result.attribution.steps[1:]
            ],
            "bic": best_by_bic(result.attribution),
            "regression_gap_n": regressed_gap(result.forward, result.residual_before),
            "where": data["where"],
            "seconds": sum(data["seconds"].values()),
        }  # fmt: skip
    with atomic_file(verdict_path(this, at)) as temporary:
        temporary.write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
    return {"kind": answer["kind"], "effects": answer["effects"], "candidates": answer["candidates"]}


def opened_case(case: Case, work: Path) -> dict[str, Any]:
    """The verdict with its truth, checked against the seal."""
    from palpate.scenes.laboratory.sealing import opened

    verdict = json.loads(verdict_path(case, work).read_text(encoding="utf-8"))
    truth = opened(work / f"{case.recording}.sealed", work / "truth" / f"{case.recording}.json")
    return {"key": case.key, "case": case.as_json(), "verdict": verdict, "truth": truth}
