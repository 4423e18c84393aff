"""A case's three steps, each kept in the work folder: sealed recording, model, verdict; then the truth."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from mechanics.errors import PalpateError
from mechanics.files import atomic_file
from palpate.benchmarks._diagnosis_cases import Case


class NotSolved(Exception):
    """The touches of a case would have to be solved first."""


def prepared(case: Case, work: Path) -> bool:
    """Whether recording and model are there."""
    return (work / "models" / case.recording / "model.toml").exists() or _failure(case, work).exists()


def prepare(case: Case, work: Path, *, solve: bool) -> None:
    """Simulate with the truth sealed, and reconstruct. Raises NotSolved unless `solve` allows for hours."""
    from mechanics.model import write_model
    from mechanics.recording import read_recording
    from reconstruct.pipeline import ReconstructOptions, reconstruct

    for folder in ("truth", "models", "verdicts"):
        (work / folder).mkdir(parents=True, exist_ok=True)
    samples = work / f"{case.recording}.csv.gz"
    if not samples.exists():
        _simulate(case, work, samples, solve)
    try:
        write_model(
            work / "models" / case.recording, reconstruct(read_recording(samples), ReconstructOptions())
        )
    except PalpateError as error:
        _failure(case, work).write_text(f"{error}\n", encoding="utf-8")


def _failure(case: Case, work: Path) -> Path:
    return work / "models" / f"{case.recording}.failed"


def _simulate(case: Case, work: Path, samples: Path, solve: bool) -> None:
    from scenes.laboratory.hand import cohort_hand
    from scenes.laboratory.sealing import write_sealed
    from scenes.laboratory.simulate import SimulateOptions, simulate
    from scenes.phantoms import phantom

    def refuse(label: str, share: float) -> None:
        if not solve:
            raise NotSolved(label)

    options = SimulateOptions(
        young_modulus_pa=case.modulus_pa, force_noise_std_n=case.noise_n, coloured_share=case.coloured_share,
        protocol=case.protocol, frame=True,
    )  # fmt: skip
    hand = cohort_hand(case.seed % 997 + 1)
    made = simulate(
        phantom(case.phantom), case.effects, options, hand=hand, seed=case.seed, sizes=True, workers=1,
        progress=refuse,
    )  # fmt: skip
    write_sealed(samples, made.recording, made.truth, work / "truth" / f"{case.recording}.json")


def verdict_path(case: Case, work: Path) -> Path:
    """Where the answer is written."""
    return work / "verdicts" / f"{case.key}.json"


def judge(case: Case, work: Path, *, fast: bool) -> dict[str, Any]:
    """Diagnose; the truth stays shut. Errors are a verdict too. The answer is written."""
    from diagnose.baselines import best_by_bic, regressed_gap
    from diagnose.pipeline import DiagnoseOptions, diagnose
    from mechanics.model import read_model
    from mechanics.recording import read_recording

    answer: dict[str, Any]
    try:
        if _failure(case, work).exists():
            raise PalpateError(_failure(case, work).read_text(encoding="utf-8").strip())
        recording = read_recording(work / f"{case.recording}.csv.gz")
        model = read_model(work / "models" / case.recording)
        result = diagnose(recording, model, DiagnoseOptions(fast=fast, without=case.without))
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
            "bic": best_by_bic(result.attribution),
            "regression_gap_n": regressed_gap(result.forward, result.residual_before),
            "seconds": sum(data["seconds"].values()),
        }  # fmt: skip
    with atomic_file(verdict_path(case, work)) as temporary:
        temporary.write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
    return answer


def opened_case(case: Case, work: Path) -> dict[str, Any]:
    """The verdict with its truth, checked against the seal."""
    from scenes.laboratory.sealing import opened

    verdict = json.loads(verdict_path(case, work).read_text(encoding="utf-8"))
    truth = opened(work / f"{case.recording}.sealed", work / "truth" / f"{case.recording}.json")
    return {"key": case.key, "case": case.as_json(), "verdict": verdict, "truth": truth}
