"""From a draw to a recording on disk, by way of the virtual laboratory."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.varied.draws import Draw
from benchmarks.varied.instrument import logged, weighed
from benchmarks.varied.objects import FINENESS, Thing, thing
from benchmarks.varied.writing import object_name, write
from palpate.mechanics.recording.recording import Recording, read_recording
from palpate.mechanics.recording.segments import TimeSegment
from palpate.scenes.laboratory.curves import ALONE, Solving
from palpate.scenes.laboratory.hand import HandOptions, cohort_hand
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.presses import PlannedTouch
from palpate.scenes.laboratory.session import SimulateOptions, Staging
from palpate.scenes.laboratory.simulate import Simulation, simulate

LEAST_DEPTH_MM = 1.0


@dataclass(frozen=True)
class Varied:
    """One drawn exploration. recording: as read from its file. simulation: the laboratory's, before the
    drawn instrument (its readings and truth). thing: what was explored.
    """

    draw: Draw
    thing: Thing
    recording: Recording
    simulation: Simulation


def record(
    draw: Draw,
    folder: Path,
    effects: Mapping[str, float] | None = None,
    *,
    it: Thing | None = None,
    sizes: bool = False,
) -> Varied:
    """Explore the drawn object, or `it`, with `effects`; write NAME.csv.gz and NAME.toml into `folder`.

    The truth is the laboratory's, with the nuisances beside ([truth.nuisances]). What was solved before is
    not solved again. Raises OptionError, LabError.
    """
    varied = explored(draw, effects, it=it, sizes=sizes)
    name = "+".join([f"variety-{draw.seed:05d}", *(f"{k}={v:g}" for k, v in (effects or {}).items())])
    path = write(folder / f"{name}.csv.gz", varied.recording, draw)
    return replace(varied, recording=read_recording(path))


def explored(
    draw: Draw,
    effects: Mapping[str, float] | None = None,
    *,
    it: Thing | None = None,
    sizes: bool = False,
    complete: bool = False,
    more: Sequence[PlannedTouch] = (),
    solving: Solving = ALONE,
) -> Varied:
    """The same, with nothing written. complete: by that protocol, whose parts are stated where phase I is.
    more: touches after those that are drawn.
    """
    it = it or thing(draw.number)
    options = SimulateOptions(
        young_modulus_pa=draw.young_modulus_pa,
        tip_radius_m=it.tip_radius_m,
        force_noise_std_n=draw.noise_n,
        position_resolution_m=draw.resolution_m,
        finest_mm=FINENESS.finest,
    )
    staging = Staging(
        hand(draw),
        touches=(*touches(it, draw), *more),
        complete=complete,
        frame=frame(draw),
        instrument=lambda readings: weighed(readings, draw),
    )
    simulation = simulate(
        it.phantom, effects, options, seed=draw.seed, sizes=sizes, staging=staging, solving=solving
    )
    truth = {**simulation.truth, "poisson_ratio": it.phantom.poisson_ratio, "nuisances": draw.table()}
    stated = draw.poisson_ratio_stated or it.phantom.poisson_ratio != 0.49
    recording = logged(
        simulation.readings,
        draw,
        within_s=_within(simulation.motion, draw),
        phase_s=simulation.motion.phase,
        rng=np.random.default_rng([19, draw.seed]),
        tip_radius_m=it.tip_radius_m,
        segments=_stated(simulation.motion, draw),
        object_name=object_name(draw),
        poisson_ratio=it.phantom.poisson_ratio if stated else None,
        truth=truth,
    )
    return Varied(draw, it, recording, simulation)


def _stated(way: Motion, draw: Draw) -> tuple[TimeSegment, ...]:
    """What is written down of what was done beside the presses."""
    if not draw.boundary_phase_stated:
        return ()
    return tuple(
        TimeSegment(kind, round(a + draw.clock_s, 2), round(b + draw.clock_s, 2)) for kind, a, b in way.beside
    )


def touches(it: Thing, draw: Draw) -> list[PlannedTouch]:
    """The drawn presses in the order in which they are made; a few are oblique or dragged."""
    rng = np.random.default_rng([23, draw.seed])
    distinct = int(np.clip(round(draw.presses * (1 - draw.repeat_share)), 4, len(it.places)))
    order = np.arange(len(it.places))
    if draw.clusters:
        distinct = min(distinct, max(4, len(order) // 2))
        points = np.array([place[0].point for place in it.places])
        heaps = points[rng.choice(len(points), min(draw.clusters, len(points)), replace=False)]
        order = np.argsort(np.linalg.norm(points[:, None] - heaps, axis=2).min(axis=1))
    chosen = order[:distinct]
    visits = np.concatenate([rng.permutation(chosen), rng.choice(chosen, draw.presses - distinct)])
    found: list[PlannedTouch] = []
    for k in visits:
        kinds = it.places[k]
        touch = kinds[int(rng.integers(len(kinds)))] if rng.random() < 0.3 else kinds[0]
        if touch.kind != "drag":
            depth = 1e3 * rng.uniform(draw.least_depth_m, draw.most_depth_m)
            touch = replace(touch, depth=float(np.clip(depth, min(LEAST_DEPTH_MM, touch.reach), touch.reach)))
        touch = replace(touch, repeat=sum(t.site == touch.site for t in found))
        here = [i for i, t in enumerate(found) if t.site == touch.site]
        # half of the repeats follow at once
        if here and rng.random() < 0.5:
            found.insert(here[-1] + 1, touch)
        else:
            found.append(touch)
    return found


def hand(draw: Draw) -> HandOptions:
    """The drawn person's habits."""
    person = cohort_hand(draw.person)
    return replace(
        person,
        slowest_m_per_s=person.slowest_m_per_s * draw.pace,
        fastest_m_per_s=min(person.fastest_m_per_s * draw.pace, 0.150),
        trace_rounds=2.0 if draw.tracing == "two" else 1.0,
        trace_breaks=2 if draw.tracing == "broken" else 0,
        reach_pace=draw.briskness,
    )


def frame(draw: Draw) -> tuple[np.ndarray, np.ndarray]:
    """(rotation (3, 3), shift (3,) m) from the object's frame to the device's."""
    from scipy.spatial.transform import Rotation

    axis = np.array([np.cos(draw.about_rad), np.sin(draw.about_rad), 0.0])
    turned = Rotation.from_rotvec(draw.tilt_rad * axis) * Rotation.from_rotvec([0.0, 0.0, draw.turn_rad])
    return turned.as_matrix(), np.array(draw.shift_m)


def _within(way: Motion, draw: Draw) -> tuple[float, float]:
    """(start, end) s of what is recorded: whole, or from within the tracing, or into the last touch."""
    rng = np.random.default_rng([29, draw.seed])
    start, end = float(way.t[0]), float(way.t[-1])
    if draw.begins_in_contact:
        start = way.phase[0] + rng.uniform(0.1, 0.4)
    if draw.ends_in_contact:
        last = way.t[(way.touch == way.touch.max()) & (way.s > 0)]
        end = float(last[0] + rng.uniform(0.3, 0.8) * (last[-1] - last[0]))
    return start, end
