"""What a recording can show at all: the instrument on the rigid support, and from which size an effect shows.

Beside what the support tells stands the truth, where the recording states it: the tool's compliance, and the
share of a normal force that a force gain reads sideways. A size that a recording shows is one that stands
out of noise, first touches, stiffness of places and other nuisances once the modulus has had its say.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import table
from palpate.mechanics.model.files import read_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.recording.recording import Recording, read_recording


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recordings, their models, and whether the sizes are asked for."""
    parser.add_argument("recordings", nargs="+", metavar="REC", help="recordings, with or without [truth]")
    parser.add_argument("--models", type=Path, help="folder of models, each named as its recording's file")
    parser.add_argument(
        "--support-only", action="store_true", help="leave out the sizes, which need a model's places solved"
    )


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Read every recording's support and weigh its presses; print two tables."""
    support: list[dict[str, Any]] = []
    limits: dict[str, dict[str, float]] = defaultdict(dict)
    noise: dict[str, float] = {}
    for path in map(Path, arguments.recordings):
        name = path.name.split(".")[0]
        recording = read_recording(path)
        model = _model(recording, arguments.models and arguments.models / name)
        support.append({"recording": name, **_support(recording, model)})
        if not arguments.support_only:
            noise[name] = model.presses.vector_noise_n
            for effect, limit in _limits(recording, model).items():
                limits[effect][name] = limit
    print(table(["recording", "read [mm/N]", "error", "true", "sideways z", "sideways", "true"], [
        [s["recording"], *(f"{1e3 * s[k]:.4f}" for k in ("compliance", "error", "true_compliance")),
         f"{s['sideways_z']:.1f}", f"{s['sideways']:.3f}", f"{s['true_sideways']:.3f}"]
        for s in support]))  # fmt: skip
    if limits:
        print(table(["effect, mN that show", *noise], [
            [effect, *(f"{1e3 * own[n]:.1f}" if np.isfinite(own.get(n, np.inf)) else "-" for n in noise)]
            for effect, own in limits.items()]))  # fmt: skip
        print("noise of the vector, mN: " + ", ".join(f"{n} {1e3 * v:.1f}" for n, v in noise.items()))
    return {"support": support, "detectable_n": limits, "vector_noise_n": noise}


def _model(recording: Recording, path: Path | None) -> Model:
    from palpate.reconstruction.pipeline import ReconstructOptions, reconstruct

    return read_model(path) if path else reconstruct(recording, ReconstructOptions())


def _support(recording: Recording, model: Model) -> dict[str, float]:
    from palpate.diagnosis.instrument.support_readings import rigid_of

    normal = model.support.normal
    found = rigid_of(recording, model.presses, normal)
    parameters: Mapping[str, Any] = (recording.truth or {}).get("parameters", {})
    stiffness = parameters.get("tool_compliance", {}).get("stiffness_n_per_m", np.inf)
    read = np.asarray(parameters.get("force_gain", {}).get("matrix", np.eye(3))) @ normal
    true = {
        "true_compliance": 1 / stiffness,
        "true_sideways": float(np.linalg.norm(read / (read @ normal) - normal)),
    }
    if found is None:
        return {**dict.fromkeys(("compliance", "error", "sideways", "sideways_z"), np.nan), **true}
    return {
        "compliance": found.compliance,
        "error": found.error,
        "sideways": float(np.linalg.norm(found.sideways)),
        "sideways_z": found.sideways_z,
        **true,
    }


def _limits(recording: Recording, model: Model) -> dict[str, float]:
    """{effect: N} of what the diagnosis searches for."""
    from palpate.diagnosis.forward.prediction import build_forward
    from palpate.diagnosis.forward.touches import touches_of
    from palpate.diagnosis.options import AttributionOptions, NuisanceOptions
    from palpate.diagnosis.search.descent import misfit_of
    from palpate.diagnosis.search.evidence import Search, detectable
    from palpate.diagnosis.search.site_stiffness import site_stiffness_sd
    from palpate.mechanics.effects.base import Role
    from palpate.mechanics.effects.registry import effects
    from palpate.reconstruction.presses_on_model import presses_on

    forward = build_forward(touches_of(presses_on(recording, model)), model)
    nuisance = NuisanceOptions()
    site_sd = site_stiffness_sd(forward, nuisance)
    strain = next(e for e in effects() if e.role is Role.KNOWN)
    search = Search(
        forward, model.material.young_modulus_pa, nuisance=nuisance, options=AttributionOptions(),
        site_sd=site_sd, finite_strain=strain,
    )  # fmt: skip
    base = search.judge([strain])
    searched = [e for e in effects() if e.role is Role.SEARCHED]
    misfit = misfit_of(forward, base.found, site_sd)
    search.starts = {e.name: e.hints.seek(forward, misfit) for e in searched if e.hints.seek is not None}
    return detectable(search, base, searched)
