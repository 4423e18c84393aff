"""A whole recording: phantom, effects and a hand in; samples and the truth about them out.

What is true about a simulated recording: its effects, each with its size in newtons.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.presses.gap_bins import gap_by_bin
from palpate.mechanics.presses.table import HOLDING, LOADING, OUTSIDE, UNLOADING
from palpate.mechanics.recording.recording import Recording, read_recording, write_recording
from palpate.mechanics.result import Result
from palpate.scenes.laboratory.curves import EVERY_CORE, Solving
from palpate.scenes.laboratory.effects import REGISTRY, EffectContext, SensedSamples, effect
from palpate.scenes.laboratory.force import elastic_force
from palpate.scenes.laboratory.hand_path import Motion
from palpate.scenes.laboratory.paths import SIDEWAYS, WAY_OUT
from palpate.scenes.laboratory.presses import PlannedTouch, press_set
from palpate.scenes.laboratory.session import Session, SimulateOptions, Staging
from palpate.scenes.laboratory.tracing import RATE_HZ
from palpate.scenes.phantoms import Phantom

if TYPE_CHECKING:
    from palpate.scenes.laboratory.session import Session


def truth_of(
    session: Session,
    present: Sequence[str],
    clean: np.ndarray,
    whole: SensedSamples,
    sizes: bool,
    strengths: Mapping[str, float],
) -> dict[str, Any]:
    """The recording's [truth]: what was there, and each effect's size where `sizes` asks for it.

    clean: (n, 3) N, the force of `whole` without noise. Effects smaller than the noise are not listed.
    """
    way = session.way
    mask = contact_samples(way)
    noise = session.options.force_noise_std_n
    truth: dict[str, Any] = {
        "young_modulus_pa": float(session.modulus),
        "shape": session.phantom.shape,
        "effects": [],
        "noise_rms_n": float(noise),
        "force_rms_in_contact_n": _rms(clean[mask]),
        "contact_samples": int(mask.sum()),
        "simulator": "palpate virtual laboratory",
        "press_set": session.options.presses,
        "protocol": session.options.protocol,
        "device_from_object_rotation": session.rotation.round(9).tolist(),
        "device_from_object_shift_mm": (1e3 * session.shift).round(6).tolist(),
        "strengths": dict(strengths),
        "parameters": {name: dict(p) for name, p in session.parameters.items() if p},
    }
    names = list(present) + (["regions"] if session.phantom.regions else [])
    if session.phantom.regions:
        truth["regions"] = {
            r.name: {"centre_m": list(r.centre_m), "radius_m": r.radius_m, "modulus_ratio": r.modulus_ratio}
            for r in session.phantom.regions
        }
    if not sizes:
        truth["effects"] = ["inclusion" if name == "regions" else name for name in names]
        return truth
    truth["sizes"] = {}
    for name in names:
        # nothing that needs finite strain can be kept without it: its size is that of the plain solid
        gone = [n for n in present if effect(n).needs_finite] if name == "finite_strain" else []
        with_it = session.run([n for n in present if n not in gone])[1] if gone else clean
        rest = [other for other in present if other != name and other not in gone]
        without = _answered(session, rest, whole, regions=name != "regions")
        label = "inclusion" if name == "regions" else name
        truth["sizes"][label] = size_of(with_it[mask], without[mask], session.felt[mask])
    if names:
        truth["where"] = _where(session, present, clean, whole, way)
    session.run(present)
    ranked = sorted(truth["sizes"], key=lambda n: -truth["sizes"][n]["rms_n"])
    truth["effects"] = [name for name in ranked if truth["sizes"][name]["rms_n"] > noise]
    if truth["effects"]:
        truth["dominant_effect"] = truth["effects"][0]
    return truth


def _answered(session: Session, rest: Sequence[str], whole: SensedSamples, *, regions: bool) -> np.ndarray:
    """(n, 3) N, device frame: the force with the effects `rest` alone, where the instrument says that the tip
    is."""
    readings, force = session.run(rest, regions=regions)
    moved = 1e3 * (whole.position - readings.position) @ session.rotation
    if np.abs(moved).max() > 1e-6:
        _, force = session.run(rest, regions=regions, moved=moved)
    return force


def _where(
    session: Session, present: Sequence[str], clean: np.ndarray, whole: SensedSamples, way: Motion
) -> dict[str, Any]:
    """N rms of the gap in bins (mechanics.presses.gap_bins) and, beside `press_n`, when each touch was:
    `press_s`, (first, last) s of the laboratory's clock.

    The gap: what was read less what the ideal object would answer, that force's best factor (another modulus)
    taken off. What is read in free air too is in both, as it acts on every sample.
    """
    aired = [name for name in present if _reads_in_air(whole, name, session)]
    gap = clean - _answered(session, aired, whole, regions=False)
    elastic = elastic_force(session.way, session.forces((), False), session.modulus) @ session.rotation.T
    rows = np.flatnonzero(contact_samples(way) & (way.touch >= 0))
    gap, elastic = gap[rows], elastic[rows]
    gap -= (gap * elastic).sum() / max((elastic**2).sum(), 1e-300) * elastic
    touch, t = way.touch[rows], way.t[rows]
    deepest = np.array([each.depth for each in session.touches])[touch]
    depth = np.where(way.leg[rows] == SIDEWAYS, deepest, way.s[rows])
    phase = np.where(way.leg[rows] == WAY_OUT, UNLOADING, LOADING)
    phase[depth >= 0.9 * deepest] = HOLDING
    phase[depth <= 0] = OUTSIDE
    spans = [t[touch == k][[0, -1]].round(3).tolist() for k in range(len(session.touches))]
    square = (gap**2).sum(axis=1)
    return {"press_s": spans, **gap_by_bin(square, touch, len(session.touches), depth, phase, t)}


def _reads_in_air(whole: SensedSamples, name: str, session: Session) -> bool:
    """Whether the instrument reads a force of this effect where nothing is touched."""
    read = effect(name).on_readings
    untouched = replace(whole, force=np.zeros_like(whole.force))
    return read is not None and bool(read(untouched, session.parameters[name]).force.any())


def contact_samples(way: Motion) -> np.ndarray:
    """(n,) bool: from first touch to the loss of touch of every palpation, and 50 ms before and after."""
    inside = (way.touch >= 0) & ((way.s > 0) | (way.leg == 1))
    width = int(0.05 * RATE_HZ)
    count = np.concatenate([[0], np.cumsum(inside)])
    at = np.arange(len(inside))
    low, high = np.maximum(at - width, 0), np.minimum(at + width + 1, len(inside))
    return count[high] - count[low] > 0


def size_of(with_effect: np.ndarray, without: np.ndarray, felt: np.ndarray) -> dict[str, float]:
    """Size of an effect from forces (k, 3) N: rms of the difference, also after the best factor on `felt`,
    the object's part of `without`: another modulus scales no weight and no bias.
    """
    change = with_effect - without
    more = float((change * felt).sum() / max((felt * felt).sum(), 1e-300))
    return {
        "rms_n": _rms(change),
        "rms_after_best_scale_n": _rms(change - more * felt),
        "best_scale": 1 + more,
    }


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).sum(axis=1).mean())) if len(values) else 0.0


@dataclass(frozen=True, eq=False, repr=False)
class Simulation(Result):
    """A recording of the virtual laboratory and the truth about it; goes wherever a recording goes.

    body: the phantom as it was explored. `clean_n` (n, 3) N is the force on the tool without noise, device
    frame; `readings` are it with the true positions beside, before noise and rounding; `motion` is the
    hand's true way, object frame. `ideal_n` (n, 3): where asked for, what the ideal
    object would have answered to the same way. `plot`: force over time. `show`: the tip's path.
    """

    recording: Recording
    truth: Mapping[str, Any]
    clean_n: np.ndarray
    touches: tuple[PlannedTouch, ...]
    motion: Motion
    readings: SensedSamples
    ideal_n: np.ndarray | None = None
    body: Phantom | None = None

    @property
    def phantom(self) -> str:
        """The name of what was explored."""
        return "object" if self.body is None else Path(self.body.name).name

    def save(self, path: Path | str) -> Simulation:
        """Write the recording with its truth; returns the simulation whose recording knows its file."""
        written = write_recording(path, self.recording, truth=self.truth)
        return replace(self, recording=read_recording(written))


def simulate(
    phantom: Phantom,
    effects: Mapping[str, float] | None = None,
    options: SimulateOptions | None = None,
    *,
    seed: int = 0,
    sizes: bool = True,
    ideal: bool = False,
    staging: Staging | None = None,
    solving: Solving = EVERY_CORE,
) -> Simulation:
    """Explore `phantom` with `effects` (name: strength, see INTERFACE of the docs) and write down what is
    read.

    The ideal model has no effect: linear elastic, bonded, sticking, exact but for noise. Regions of the
    phantom count as the effect `inclusion`. seed: timing, straying, tracing and noise; the press set has
    its own number, so that solved curves are shared. sizes: also solve without each effect, to state its
    size. staging: lay down hand, touches, frame or instrument. Raises OptionError, LabError.
    """
    options = options or SimulateOptions()
    strengths = {name: float(value) for name, value in (effects or {}).items() if float(value) != 0}
    for name, value in strengths.items():
        least = effect(name).least_strength
        if not (np.isfinite(value) and value != 0 and least <= value <= 16):
            above = f"at least {least:g}, not 0," if least else "greater than 0"
            raise OptionError(f"effect '{name}' has strength {value}; it must be {above} and at most 16")
    if any(effect(name).needs_finite for name in strengths):
        strengths.setdefault("finite_strain", 1.0)
    staging = staging or Staging()
    modulus = options.young_modulus_pa or phantom.young_modulus_pa
    plain = replace(phantom, regions=())
    touches = staging.touches or tuple(press_set(plain, options.protocol, options.presses))
    parameters = _parameters(plain, strengths, modulus, options, touches)
    session = Session(phantom, modulus, options, touches, parameters, seed, staging, solving)
    present = tuple(parameters)
    whole, clean = session.run(present)
    truth = truth_of(session, present, clean, whole, sizes, strengths)
    recording, way = session.recording(whole, clean, truth), session.way
    plain_n = session.run((), regions=False)[1] if ideal else None
    return Simulation(recording, truth, clean, touches, way, whole, plain_n, phantom)


def _parameters(
    phantom: Phantom,
    strengths: Mapping[str, float],
    modulus: float,
    options: SimulateOptions,
    touches: Sequence[PlannedTouch],
) -> dict[str, dict[str, Any]]:
    out = {}
    for name in sorted(strengths, key=list(REGISTRY).index):
        rng = np.random.default_rng([options.presses, zlib.crc32(name.encode())])
        bench = EffectContext(phantom, modulus, options.tip_radius_m, tuple(touches), rng)
        out[name] = effect(name).parameters(strengths[name], bench)
    return out
