"""A play of the device, alone and beside a second cause, pressing and sliding: how often it is named.

Recordings of a block by the mechanics that the diagnosis predicts with, so that nothing but the instrument
and the second cause is in question: a hand that trembles presses twelve places, or slides to and fro at
depth, in a device frame turned by chance. The reading follows the tip through a play on each axis of the
device, jitters and is rounded. What differs from place to place is left out of the library. Lengths m,
forces N.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.evidence import rates
from benchmarks.timing import table
from palpate.diagnosis.forward.prediction import Forward, build_forward
from palpate.diagnosis.options import DiagnoseOptions
from palpate.diagnosis.pipeline import diagnose
from palpate.mechanics.effects.backlash import EFFECT as PLAY
from palpate.mechanics.effects.base import Scope
from palpate.mechanics.effects.finite_strain import EFFECT as STRAIN
from palpate.mechanics.effects.friction_slip import EFFECT as SLIP
from palpate.mechanics.effects.registry import effect, effects
from palpate.mechanics.model.material import ObjectMaterial
from palpate.mechanics.model.model import Model, Support, Tool
from palpate.mechanics.presses.making import of_paths
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.recording.side_of_play import play
from palpate.mechanics.shape.tetmesh import box_mesh

MODULUS_PA, NU, TIP_M, RATE_HZ = 20e3, 0.49, 0.005, 500.0
NOISE_N, TREMOR_M, TREMOR_HZ = 0.01, 25e-6, 9.0
WIDTHS_M = (0.25e-3, 0.5e-3)
STEPS_M, JITTERS_M = (5e-6, 6e-5), (0.0, 1e-5)
"""Of the reading: how it is rounded, and its noise before that, rms."""
AIR_S, TRAVEL_S = 0.6, 0.8
WITHOUT = ",".join(e.name for e in effects() if e.scope is Scope.PLACES or e.hints.expensive)
MOTIONS = ("press", "slide", "both")
SECOND: dict[str, tuple[float, ...]] = {
    "viscoelasticity": (0.3, float(np.log(0.3)), 0.0, float(np.log(3.0))),
    "friction_slip": (0.15,),
    "time_delay": (0.02,),
}
"""Values of the second cause, in the order of its parameters."""


@dataclass(frozen=True)
class Case:
    """One recording. second: a cause beside the play, '' for none. play: whether there is one."""

    seed: int
    motion: str
    second: str = ""
    play: bool = True
    finite: bool = False

    @property
    def true(self) -> frozenset[str]:
        """Names that belong in the answer."""
        names = ([PLAY.name] if self.play else []) + ([self.second] if self.second else [])
        return frozenset(names)


def cases(alone: int, pairs: int, seed: int) -> list[Case]:
    """Plays by themselves on every motion in turn, every second one of a neo-Hookean block; pairs with each
    second cause in turn, sliding where friction is to be felt; each second cause without a play, and as many
    controls as plays alone. Mixed, so that what was done is a fair sample."""
    found = [Case(seed + i, MOTIONS[i % 3], finite=i % 2 == 1) for i in range(alone)]
    names = list(SECOND)
    for i in range(pairs):
        name = names[i % len(names)]
        motion = ("slide", "both")[i // 3 % 2] if name == SLIP.name else MOTIONS[i // 3 % 3]
        found.append(Case(seed + 1000 + i, motion, name, finite=i % 2 == 1))
    found += [Case(seed + 2000 + i, "both", name, play=False) for i, name in enumerate(names)]
    found += [Case(seed + 3000 + i, MOTIONS[i % 3], play=False, finite=i % 2 == 1) for i in range(alone)]
    return [found[i] for i in np.random.default_rng(seed).permutation(len(found))]


def recorded(case: Case) -> tuple[Recording, Model]:
    """The recording, and the model that is compared with: of the true shape and modulus."""
    rng = np.random.default_rng(case.seed)
    turn = Rotation.random(random_state=rng).as_matrix()
    mesh = box_mesh((4, 4, 3), (0.08, 0.08, 0.04))
    mesh = replace(mesh, points=mesh.points @ turn.T).quadratic()
    model = Model(
        mesh=mesh, material=ObjectMaterial(MODULUS_PA, NU), support=Support(np.zeros(3), turn[:, 2]),
        tool=Tool(TIP_M), mesh_size_m=0.02,
    )  # fmt: skip
    around = (-0.02, 0.0, 0.02)
    points = np.array([(x, y, 0.04) for x in around for y in around] + [(0.04, y, 0.022) for y in around])
    normals = np.array([(0, 0, 1.0)] * 9 + [(1.0, 0, 0)] * 3)
    order = np.concatenate([rng.permutation(len(points)), rng.permutation(len(points))[: len(points) // 2]])
    ways = _joined(
        [_way(case.motion, number, points[k], normals[k], rng) for number, k in enumerate(order)],
        normals[order],
    )
    starts = np.cumsum([0, *(len(way) for way in ways)])
    tip, normal = np.concatenate(ways) @ turn.T, normals[order] @ turn.T
    centre = points[order] @ turn.T + TIP_M * normal
    force = _force(case, model, starts, tip, centre, normal)
    t = np.arange(len(tip)) / RATE_HZ
    read = tip
    if case.play:
        read = np.empty_like(tip)
        width = float(rng.uniform(*WIDTHS_M))
        play(np.array([0, len(tip)]), np.ascontiguousarray(tip), np.zeros((1, 3)), width, read)
    reader = np.random.default_rng([case.seed, 1])
    step, jitter = np.exp(reader.uniform(*np.log(STEPS_M))), reader.uniform(*JITTERS_M)
    read = read + jitter * reader.normal(size=read.shape)
    recording = Recording(
        t=t, position=np.round(read / step) * step,
        force_on_tool=force + rng.normal(0, NOISE_N, force.shape),
        sample_rate_hz=RATE_HZ, tip_radius_m=TIP_M, poisson_ratio=NU,
    )  # fmt: skip
    return recording, model


def _way(
    motion: str, number: int, point: np.ndarray, normal: np.ndarray, rng: np.random.Generator
) -> np.ndarray:
    """(n, 3) m, the tip's centre from the air into the object and out again, trembling, object frame."""
    depth, speed = float(rng.uniform(2.5e-3, 4.2e-3)), float(np.exp(rng.uniform(np.log(6e-3), np.log(5e-2))))
    slides = motion == "slide" or (motion == "both" and number % 2 == 1)
    hold, ramp = (1.2 if slides else float(rng.uniform(0.1, 0.6))), depth / speed
    knots = np.cumsum([0.0, AIR_S, ramp, hold, ramp, AIR_S])
    t = np.arange(0.0, knots[-1], 1 / RATE_HZ)
    away = AIR_S * max(speed, 0.01)
    into = np.interp(t, knots, [-away, 0.0, depth, depth, 0.0, -away])
    across = np.cross(normal, rng.normal(size=3))
    across /= np.linalg.norm(across)
    span = float(rng.uniform(2e-3, 4e-3)) if slides else 0.0
    # to and fro at depth, and back to where it went in
    aside = span * np.interp(t, knots[2] + hold * np.linspace(0, 1, 5), [0.0, 1.0, -0.5, 0.6, 0.0])
    tremor = np.sqrt(2) * TREMOR_M * np.sin(2 * np.pi * (TREMOR_HZ * t[:, None] + rng.uniform(size=3)))
    return point + (TIP_M - into)[:, None] * normal + aside[:, None] * across + tremor


def _joined(ways: list[np.ndarray], normals: np.ndarray) -> list[np.ndarray]:
    """The ways with the tip's travel to the next in between, around the object."""
    share = np.linspace(0, 1, round(TRAVEL_S * RATE_HZ))[1:-1, None]
    even = share**3 * (10 - 15 * share + 6 * share**2)
    found = []
    for k, way in enumerate(ways[:-1]):
        out = 0.03 * (4 * even * (1 - even)) * (normals[k] + normals[k + 1])
        found.append(np.vstack([way, way[-1] + even * (ways[k + 1][0] - way[-1]) + out]))
    return [*found, ways[-1]]


def _force(
    case: Case, model: Model, starts: np.ndarray, tip: np.ndarray, centre: np.ndarray, normal: np.ndarray
) -> np.ndarray:
    """(n, 3) N on the tool by the mechanics, with the second cause, device frame."""
    made = of_paths(
        starts, tip, np.zeros_like(tip), centre, normal, tip_radius_m=TIP_M, sample_rate_hz=RATE_HZ
    )
    forward: Forward = build_forward(replace(made, columns={"lead": np.zeros_like(tip)}), model)
    settings = forward.ideal(MODULUS_PA)
    if case.finite:
        STRAIN.act(settings, np.zeros(0), forward)
    if case.second:
        effect(case.second).act(settings, np.array(SECOND[case.second]), forward)
    force = forward.predict(settings)
    # behind the plane of a place lies more than the object
    last = starts[1:] - np.append(np.full(len(starts) - 2, round(TRAVEL_S * RATE_HZ) - 2), 0)
    force[np.arange(len(tip)) >= last[made.press]] = 0.0
    return np.einsum("nji,nj->ni", made.frame[made.press], force)


def judged(case: Case) -> dict[str, Any]:
    """What a diagnosis says of a case, and its CPU s."""
    recording, model = recorded(case)
    begun = time.process_time()
    found = diagnose(recording, model, DiagnoseOptions(without=WITHOUT, bootstrap=100, seed=case.seed))
    named = [name for name in found.effects if name != STRAIN.name]
    return {
        "seed": case.seed, "motion": case.motion, "true": sorted(case.true), "finite": case.finite,
        "kind": found.kind, "named": named, "candidates": list(found.candidates),
        "strain_named": STRAIN.name in found.effects, "cpu_s": time.process_time() - begun,
    }  # fmt: skip


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """How many, and their seed."""
    parser.add_argument("--alone", type=int, default=10, help="recordings with a play alone")
    parser.add_argument("--pairs", type=int, default=10, help="recordings with a second cause beside it")
    parser.add_argument("--seed", type=int, default=0, help="of the first; evaluation: 500")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Judge every case, and count."""
    rows = []
    for case in cases(arguments.alone, arguments.pairs, arguments.seed):
        rows.append(judged(case))
        last = rows[-1]
        print(f"{last['seed']:5d} {last['motion']:6s} {'+'.join(last['true']):28s} "
              f"{last['kind']:14s} {'+'.join(last['named'])} | {'+'.join(last['candidates'])} "
              f"({last['cpu_s']:.0f} s)", flush=True)  # fmt: skip
    counted = _rates(rows)
    print(table(["rate", "hits", "of"], [[name, *pair] for name, pair in counted.items()]))
    return {"cases": rows, "figures": rates(counted)}


def _rates(rows: list[dict[str, Any]]) -> dict[str, tuple[int, int]]:
    alone = [r for r in rows if r["true"] == [PLAY.name]]
    pairs = [r for r in rows if PLAY.name in r["true"] and len(r["true"]) == 2]
    without = [r for r in rows if PLAY.name not in r["true"]]
    controls = [r for r in rows if not r["true"]]
    finite = [r for r in alone + pairs if r["finite"]]
    return {
        "play first, alone": (sum(r["named"][:1] == [PLAY.name] for r in alone), len(alone)),
        "play and nothing else, alone": (sum(r["named"] == [PLAY.name] for r in alone), len(alone)),
        "both of a pair, and nothing else": (sum(sorted(r["named"]) == r["true"] for r in pairs), len(pairs)),
        "both of a pair named": (sum(set(r["true"]) <= set(r["named"]) for r in pairs), len(pairs)),
        "play named without one": (sum(PLAY.name in r["named"] for r in without), len(without)),
        "anything named of a control": (sum(bool(r["named"]) for r in controls), len(controls)),
        "finite strain named of a neo-Hookean block": (sum(r["strain_named"] for r in finite), len(finite)),
    }
