"""What is no part of the question, drawn by seed from wide distributions: hand, instrument, writing.

Nuisances are not effects: a recording's truth is the same with any of them.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from benchmarks.varied.objects import POOL

RATES_HZ = (300.0, 500.0, 1000.0, 2000.0)
ORIENTATIONS = ("given", "constant", "absent")
TRACINGS = ("one", "two", "broken")


@dataclass(frozen=True)
class Draw:
    """One exploration's nuisances, its object and modulus. Distributions: `draw`; SI units.

    number: which of the pool's objects. tilt_rad, about_rad, turn_rad, shift_m: the device's frame against
    the support's. jitter: rms of the sampling instants, shares of a period. lost_share: of the samples.
    slow_share: of the noise's power below 10 Hz. repeat_share: of the presses that return to a place.
    clusters: 0 presses spread evenly, else in so many heaps. pace, briskness: of the press and of the way
    through the air, 1 the average hand's. script: number of a writing system, of `benchmarks.varied.writing`.
    """

    seed: int
    number: int
    young_modulus_pa: float
    poisson_ratio_stated: bool
    tilt_rad: float
    about_rad: float
    turn_rad: float
    shift_m: tuple[float, float, float]
    boundary_phase_stated: bool
    rate_hz: float
    jitter: float
    lost_share: float
    clock_s: float
    force_on_object: bool
    orientation: str
    tool_mass_kg: float
    tool_mass_stated: bool
    tared: bool
    noise_n: float
    noise_stated: bool
    slow_share: float
    resolution_m: float
    resolution_stated: bool
    presses: int
    repeat_share: float
    clusters: int
    least_depth_m: float
    most_depth_m: float
    person: int
    pace: float
    briskness: float
    begins_in_contact: bool
    ends_in_contact: bool
    tracing: str
    script: int

    def table(self) -> dict[str, object]:
        """Its fields as plain values."""
        return {f.name: getattr(self, f.name) for f in fields(self)}


def draw(seed: int) -> Draw:
    """The `seed`-th exploration. Log-uniform where a range spans decades, else uniform; coins are fair where
    no share is told:

    modulus 5 to 150 kPa; tilt 0 to 30 degrees, shift up to 0.5 m an axis; sampling at 300, 500, 1000 or
    2000 Hz, half with jitter of 1 to 15 % of a period, half with 0.01 to 2 % of the samples lost; tool mass 0
    in a quarter, else up to 100 g; noise 0.005 to 0.04 N an axis, 0 to 30 % of its power slow; position steps
    of 1 to 50 um; 12 to 60 presses, of which 5 to 60 % return to a place, in half of the recordings heaped at
    one to three places; two depths of 1.5 to 10 mm between which presses are drawn; pace 0.5 to 2, briskness
    0.6 to 2.2; a quarter begins, a quarter ends in contact; a quarter of the clocks starts late.
    """
    rng = np.random.default_rng([17, seed])

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    def coin(share: float = 0.5) -> bool:
        return bool(rng.random() < share)

    def shift() -> float:
        return float(rng.uniform(-0.5, 0.5))

    depths = sorted((spread(1.5e-3, 10e-3), spread(1.5e-3, 10e-3)))
    return Draw(
        seed=seed,
        number=int(rng.integers(POOL)),
        young_modulus_pa=spread(5e3, 150e3),
        poisson_ratio_stated=coin(),
        tilt_rad=float(np.radians(rng.uniform(0, 30))),
        about_rad=float(rng.uniform(-np.pi, np.pi)),
        turn_rad=float(rng.uniform(-np.pi, np.pi)),
        shift_m=(shift(), shift(), shift()),
        boundary_phase_stated=coin(),
        rate_hz=float(rng.choice(RATES_HZ)),
        jitter=spread(0.01, 0.15) if coin() else 0.0,
        lost_share=spread(1e-4, 0.02) if coin() else 0.0,
        clock_s=float(rng.uniform(0, 1e5)) if coin(0.25) else 0.0,
        force_on_object=coin(),
        orientation=str(rng.choice(ORIENTATIONS)),
        tool_mass_kg=0.0 if coin(0.25) else float(rng.uniform(0, 0.1)),
        tool_mass_stated=coin(),
        tared=coin(),
        noise_n=spread(0.005, 0.04),
        noise_stated=coin(),
        slow_share=float(rng.uniform(0, 0.3)),
        resolution_m=spread(1e-6, 5e-5),
        resolution_stated=coin(),
        presses=int(round(spread(12, 60))),
        repeat_share=float(rng.uniform(0.05, 0.6)),
        clusters=int(rng.integers(1, 4)) if coin() else 0,
        least_depth_m=depths[0],
        most_depth_m=depths[1],
        person=int(rng.integers(1, 10_000)),
        pace=spread(0.5, 2.0),
        briskness=spread(0.6, 2.2),
        begins_in_contact=coin(0.25),
        ends_in_contact=coin(0.25),
        tracing=str(rng.choice(TRACINGS)),
        script=int(rng.integers(1000)),
    )
