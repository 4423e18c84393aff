"""The material of a specimen from tests in a machine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

from palpate.diagnosis.forward.touches import touches_of
from palpate.diagnosis.specimen.approach import Approach, approach_of
from palpate.diagnosis.specimen.baseline import without_slope
from palpate.diagnosis.specimen.bench import PEAK_N, Bench, MachineCycle, bench_of
from palpate.diagnosis.specimen.bench_diagnosis import (
    diagnose_bench,
    held_out_rivals,
    modulus_interval,
    unseen_holds,
)
from palpate.diagnosis.specimen.elastic_fit import ALL, Elastic, elastic_of
from palpate.diagnosis.specimen.few_curves import (
    INDENTATION_UNKNOWN,
    MACHINE_TAKES_ALL,
    as_read,
    material_of_few,
    seen_of_all,
    with_machine,
)
from palpate.diagnosis.specimen.result import MachineTests, Material
from palpate.diagnosis.specimen.zero import bias, late_contact
from palpate.diagnosis.verdict.result import Diagnosis
from palpate.mechanics.effects.finite_strain import EFFECT as FINITE
from palpate.mechanics.effects.registry import effects
from palpate.mechanics.effects.strain_stiffening import EFFECT as STIFFENING
from palpate.mechanics.effects.tool_compliance import EFFECT as TOOL
from palpate.mechanics.effects.viscoelasticity import EFFECT as PRONY
from palpate.mechanics.errors import OptionError
from palpate.mechanics.plausible import POISSON_RATIO, USUAL_POISSON_RATIO
from palpate.mechanics.progress import Progress, silent
from palpate.mechanics.quantities import quantity_words
from palpate.reconstruction.machine_curves.relaxation import held_out_relaxation
from palpate.reconstruction.machine_curves.uniaxial import (
    CEILING,
    LAWS,
    MOST_STRAIN,
    chosen,
    fit_law,
    held_out,
)

_ELASTIC = {TOOL.name, FINITE.name}
"""Effects that the fit of the ways in knows itself: it tells the modulus where no other is named."""
_NO_LAYER = (
    "the layer's thickness counts from 6 curves on: of fewer the modulus is a half-space's, too high for a "
    "layer that is not ten times as thick as the contact is wide"
)
UNIAXIAL_UNKNOWN = (
    "friction at the faces",
    "Poisson's ratio",
    "memory (one speed)",
    "what differs from place to place",
)
RELAXATION_UNKNOWN = (
    "stiffness against depth",
    "what is faster than the ramp or slower than the hold",
    "place",
)


def material_of(
    tests: MachineTests,
    files: Sequence[str | Path],
    *,
    layer_m: float | None = None,
    poisson_ratio: float | None = None,
    specimens: bool = False,
    fast: bool = False,
    seed: int = 0,
    progress: Progress = silent,
) -> Material:
    """What the curves say. Raises ContactError where none has a contact, OptionError for what fits no such
    test."""
    names = tuple(Path(f).name for f in files)
    if layer_m is not None and not layer_m > 0:
        raise OptionError(f"--layer is {layer_m} m; it must be greater than 0")
    if poisson_ratio is not None and not POISSON_RATIO.takes(poisson_ratio):
        raise OptionError(f"--poisson-ratio is {poisson_ratio}; it must be {POISSON_RATIO.words}")
    if tests.kind in ("compression", "tension"):
        return _uniaxial(tests, names)
    if tests.kind == "relaxation":
        return _relaxation(tests, names)
    tip = tests.tip
    assert tip is not None
    nu, source = _poisson_of(poisson_ratio, tests)

    def bench(curves: Sequence[MachineCycle]) -> Bench:
        return bench_of(curves, tip, layer_m=layer_m, poisson_ratio=nu, specimens=specimens)

    raw = list(tests.curves)
    air = without_slope(tests.curves, tip, timed=tests.timed, poisson_ratio=nu, alike=not specimens)
    if len(air.slope_n_per_m):
        each = f"free air slopes by {np.median(air.slope_n_per_m):.3g} N/m of travel on the way in"
        notes = (*tests.notes, f"{each}, which is taken off, with what it is known by in the interval")
        tests = replace(tests, curves=tuple(air.curves), notes=notes)
    curves, words = late_contact(tests.curves, nu, tip)
    found, words_late = bench(curves), words
    if words is not None:
        else_pa = float(np.median(approach_of(bench(tests.curves)).modulus_pa))
        notes = (*tests.notes, f"{words}; the modulus would be {else_pa:.4g} Pa then")
        tests = replace(tests, curves=tuple(curves), notes=notes)
    elif (read := bias(curves, found)) is not None:
        words = f"the force reads {read[0]:.3g} N in free air, which is taken off"
        notes = (*tests.notes, f"{words}: the modulus would be {read[1]:.4g} Pa if it were not")
        tests = replace(tests, notes=notes)
    approach = approach_of(found)
    pull, elastic = float(approach.pull_n.max()), air.fit
    if layer_m is not None:
        elastic = None  # which knows half-spaces
    elif elastic is not None and (words_late or pull > 0):
        raw = [replace(a, level_n=b.level_n) for a, b in zip(raw, curves, strict=True)]
        elastic = elastic_of(raw, tip, nu, pull)
    made = _indentation(tests, found, approach, elastic, layer_m is not None, names, fast, seed, progress)
    return replace(made, tip=tip, poisson_ratio=nu, poisson_from=source)


def _poisson_of(stated: float | None, tests: MachineTests) -> tuple[float, str]:
    """(Poisson's ratio, who said it)."""
    if stated is not None:
        return stated, "stated"
    if tests.poisson_ratio is not None:
        return tests.poisson_ratio, "file"
    return USUAL_POISSON_RATIO, "assumed"


def _uniaxial(tests: MachineTests, names: tuple[str, ...]) -> Material:
    curves = tests.tests
    errors = held_out(curves)
    error = {name: float(np.median(e)) for name, e in errors.items()}
    law = next(each for each in LAWS if each.name == chosen(errors))
    ready = [c.upto(MOST_STRAIN) for c in curves]
    fitted = fit_law(ready, law)
    own = np.array([fit_law([c], law).young_modulus_pa for c in ready])
    few = student.ppf(0.975, len(own) - 1) if len(own) > 1 else np.nan
    spread = few * own.std(ddof=1) / np.sqrt(len(own)) if len(own) > 1 else np.nan
    error["constant"] = float(np.median([c.stress.std() / np.sqrt((c.stress**2).mean()) for c in ready]))
    c = fitted.coefficients
    parameters = {"law": law.name, "strain_zero": fitted.zero}
    if law.name.startswith("yeoh"):
        parameters |= {f"c{k + 1}0_over_c10": float(c[k] / c[0]) for k in range(1, len(c))}
    elif len(law.shapes) > 1:
        parameters["exponent"] = fitted.shape
    stiffens = law.name not in ("linear", "neo-hookean")
    closed = 1 - (error[law.name] / max(error["neo-hookean"], 1e-12)) ** 2
    words = "it stiffens otherwise than a neo-Hookean" if stiffens else f"{law.name} is enough"
    first = ready[0]
    return Material(
        kind=tests.kind,
        files=names,
        curves=len(curves),
        held_out="curve by curve" if len(curves) > 1 else "blocks of strain of one curve",
        young_modulus_pa=fitted.young_modulus_pa,
        young_modulus_ci95_pa=(fitted.young_modulus_pa - spread, fitted.young_modulus_pa + spread),
        law=law.name,
        error=error,
        verdict=f"{words}: {law.name} misses held-out stress by {100 * error[law.name]:.2g} % to "
        f"{100 * MOST_STRAIN:.0f} % strain ({CEILING} {100 * error[CEILING]:.2g} %)",
        effects=(FINITE.name, STIFFENING.name) if stiffens else (),
        closed=closed if stiffens else None,
        parameters=parameters,
        unknown=UNIAXIAL_UNKNOWN,
        seen=(
            first.stretch,
            first.stress,
            fitted.stress(first.stretch),
            "stretch",
            "engineering stress [Pa]",
        ),
    )


def _relaxation(tests: MachineTests, names: tuple[str, ...]) -> Material:
    found = [held_out_relaxation(t, value) for t, value in tests.holds]
    error = {name: float(np.median([e[name] for e, _ in found])) for name in found[0][0]}
    fit = found[0][1]
    physical = {k: v for k, v in error.items() if k not in (CEILING, "spring")}
    law = min(physical, key=lambda name: physical[name])
    closed = 1 - (error[law] / max(error["spring"], 1e-12)) ** 2
    nan = float("nan")
    return Material(
        kind="relaxation",
        files=names,
        curves=len(found),
        held_out="blocks of log time",
        young_modulus_pa=nan,
        young_modulus_ci95_pa=(nan, nan),
        law=law,
        error=error,
        verdict=f"{100 * fit.loss:.0f} % of the force is lost in the hold, which "
        + ("a Kelvin-Voigt element could do" if fit.kelvin_voigt_can else "neither 1D model can do"),
        effects=() if fit.kelvin_voigt_can else (PRONY.name,),
        closed=closed,
        parameters={PRONY.name: {"g": [g / fit.end for g in fit.g] if fit.end > 0 else list(fit.g),
                                        "tau_s": list(fit.tau_s)}},
        unknown=RELAXATION_UNKNOWN,
    )  # fmt: skip


def _indentation(
    tests: MachineTests,
    bench: Bench,
    approach: Approach,
    elastic: Elastic | None,
    layered: bool,
    names: tuple[str, ...],
    fast: bool,
    seed: int,
    progress: Progress,
) -> Material:
    unused = [c.name for c, u in zip(tests.curves, bench.used, strict=True) if not u]
    notes = list(tests.notes)
    notes += [f"without a contact, left out: {', '.join(unused)}"] if unused else []
    if np.isfinite(tests.stated_modulus_pa):
        notes.append(f"the maker's software states {tests.stated_modulus_pa:.4g} Pa")
    made = None
    if bench.tip.form == "sphere" and tests.timed:
        made = diagnose_bench(bench, fast=fast, seed=seed, progress=progress)
    if made is None:
        if elastic is None:
            notes += [_NO_LAYER] if layered else []
            assert tests.tip is not None
            elastic = elastic_of(tests.curves, tests.tip, bench.model.material.poisson_ratio)
        return material_of_few(tests, bench, approach, elastic, names, notes)
    own = bench.modulus_pa[bench.used]
    error = _held_out_errors(bench, made)
    holds = unseen_holds(bench, made)
    if holds is not None:
        error |= {"ideal, holds": holds[0], "verdict, holds": holds[1]}
        notes.append(f"of held-out holds {100 * (1 - (holds[1] / holds[0]) ** 2):.0f} % is explained")
    if bench.specimens:
        modulus, interval = float(np.median(own)), tuple(map(float, np.quantile(own, [0.025, 0.975])))
    else:
        modulus = made.young_modulus_pa / bench.similarity.modulus
        interval = as_read(modulus, modulus_interval(bench, made))
    assert made.attribution is not None
    ideal, at_bound = made.attribution.ideal.found.modulus / bench.similarity.modulus, made.at_bound
    parameters = _named_parameters(bench, made)
    takes_all = _takes_all(bench, parameters)
    at_bound += (MACHINE_TAKES_ALL,) if takes_all else ()
    if elastic is not None and set(made.effects) <= _ELASTIC:
        modulus, interval = elastic.modulus_pa, as_read(elastic.modulus_pa, elastic.interval_pa)
    if made.effects:
        plain = quantity_words("young_modulus_pa", ideal)
        notes.append(f"without {_listed(made.effects)} the modulus would be {plain}")
    elastically = elastic is not None and set(made.effects) <= _ELASTIC and TOOL.name not in made.effects
    tested = {e.name for e in effects()} - set(made.left_out)
    told = Material(
        kind="indentation",
        files=names,
        curves=len(own),
        held_out="curve by curve, normal force",
        young_modulus_pa=modulus,
        young_modulus_ci95_pa=(interval[0], interval[1]),
        law=bench.model.material.dent_law,
        error=error,
        verdict=made.summary,
        effects=made.effects,
        closed=made.gap_closed,
        closed_ci95=made.gap_closed_ci95,
        parameters=parameters,
        at_bound=at_bound,
        bound_carries=takes_all or bool(at_bound) and not interval[0] <= ideal <= interval[1],
        notes=(*notes, *made.reasons),
        unknown=(*INDENTATION_UNKNOWN, *sorted({e.name for e in effects()} - tested)),
        diagnosis=made,
        odds=tests.odds,
        seen=seen_of_all(bench, made),
    )
    return with_machine(told, elastic) if elastically and elastic is not None else told


def _takes_all(bench: Bench, parameters: dict[str, dict[str, Any]]) -> bool:
    """Whether the machine that was named leaves nothing of the travel that would tell a modulus."""
    if TOOL.name not in parameters:
        return False
    gives = PEAK_N / bench.similarity.force / parameters[TOOL.name]["stiffness_n_per_m"]
    return gives > ALL * float(np.median(bench.model.presses.depth_m)) / bench.similarity.length


def _held_out_errors(bench: Bench, made: Diagnosis) -> dict[str, float]:
    """rms over rms force of what was held out: 1D models, ceiling, a constant, the ideal model, the
    verdict."""
    touches = touches_of(bench.model.presses.net)
    rows = touches.counted
    push = touches.push[rows]
    size = float(np.sqrt((push**2).mean()))
    error = {
        name: float(np.sqrt(((force - touches.push)[rows] ** 2).mean())) / size
        for name, force in held_out_rivals(touches).items()
    }
    return error | {
        "constant": float(push.std()) / size,
        "ideal": made.gap_before_n / size,
        "verdict": made.gap_after_n / size,
    }


def _named_parameters(bench: Bench, made: Diagnosis) -> dict[str, dict[str, Any]]:
    """Those of the effects that were named, by the fit that the modulus is of, in the machine's size."""
    assert made.attribution is not None and made.forward is not None
    fit = made.attribution.final.found
    return {
        e.name: bench.similarity.back(e.report(fit.of(e.name), made.forward, fit.modulus))
        for e in fit.effects
        if e.name in made.effects
    }


def _listed(names: Sequence[str]) -> str:
    return " and ".join(n.replace("_", " ") for n in names)
