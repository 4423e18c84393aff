"""The cases of the blind benchmark: what is sealed, at which strengths, on which objects, by whose hand."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

INSTRUMENT = (
    "time_delay",
    "backlash",
    "tool_compliance",
    "force_bias",
    "force_drift",
    "force_gain",
    "tool_gravity_inertia",
)
CHEAP = (*INSTRUMENT, "viscoelasticity", "adhesion", "surface_offset")
"""Effects that act on a solved force: another strength costs seconds."""
SOLID = (
    "inclusion",
    "tip_radius",
    "compliant_base",
    "friction_slip",
    "modulus_gradient",
    "skin_layer",
    "poisson_ratio",
    "unbonded_base",
    "surface_shape",
    "strain_stiffening",
    "mullins_softening",
)
"""Effects for which every touch is solved anew (minutes to hours, then kept)."""
NEED_FINITE = ("strain_stiffening", "mullins_softening", "plasticity", "anisotropy")
PAIRS = (
    ("time_delay", "force_bias"),
    ("viscoelasticity", "tool_compliance"),
    ("adhesion", "force_gain"),
    ("viscoelasticity", "time_delay"),
    ("backlash", "force_drift"),
    ("adhesion", "viscoelasticity"),
    ("force_gain", "backlash"),
    ("tool_gravity_inertia", "time_delay"),
)
SHAPES = ("cylinder", "block", "half-sphere", "dome")
MEDIUM_SHAPES = ("cylinder", "half-sphere")


@dataclass(frozen=True)
class Case:
    """One question: `tested` names what is asked for (empty: nothing is wrong), `effects` all that acts.

    `effects` is `tested` and, on a neo-Hookean object, finite strain, which belongs in the answer but is no
    question. without: left out of the library. The hand, the modulus and the noise follow from the seed.
    """

    kind: str
    phantom: str
    seed: int
    tested: tuple[str, ...] = ()
    effects: dict[str, float] = field(default_factory=dict)
    without: str = ""
    protocol: str = "ordinary"

    @property
    def recording(self) -> str:
        """A file name for what is recorded."""
        effects = "+".join(f"{k}={v:g}" for k, v in self.effects.items()) or "none"
        return f"{self.phantom}-{self.protocol}-{effects}-{self.seed}"

    @property
    def key(self) -> str:
        """A file name for the answer."""
        return self.recording + (f"-without-{self.without}" if self.without else "")

    @property
    def modulus_pa(self) -> float:
        """Of the object."""
        return float(self._draws()[0])

    @property
    def noise_n(self) -> float:
        """Of the force sensor, each axis."""
        return float(self._draws()[1])

    @property
    def coloured_share(self) -> float:
        """Of the noise's power that is slow."""
        return float(self._draws()[2])

    def _draws(self) -> np.ndarray:
        draw = np.random.default_rng([11, self.seed])
        return np.array([draw.uniform(12e3, 40e3), draw.uniform(0.008, 0.016), draw.uniform(0.0, 0.25)])

    def as_json(self) -> dict[str, Any]:
        """Plain."""
        return {**asdict(self), "tested": list(self.tested)}


def cases(size: str, phantoms: list[str] | None, seed: int) -> list[Case]:
    """All cases of a size, shuffled, so that a run that stops early is a fair sample of it.

    quick: a few instrument effects on the cylinder. medium: controls, every cheap effect at four strengths,
    left out, absent, pairs; every cheap effect on neo-Hookean objects of two shapes; solid effects on linear
    ones of both. full: more controls, four shapes, more strengths, and solid effects on neo-Hookean objects.
    """
    if size == "quick":
        found = _round(phantoms or ["cylinder"], seed, controls=2, named=CHEAP[:6], strengths=(1.0,))
        return found
    shapes = phantoms or list(SHAPES)
    many = size == "full"
    strengths = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0) if many else (0.5, 1.0, 2.0, 4.0)
    found = _round(shapes[:1], seed, controls=150 if many else 36, named=CHEAP, strengths=strengths)
    found += _hard(shapes[0], seed + 2000)
    for i, shape in enumerate(shapes):
        if not many and phantoms is None and shape not in MEDIUM_SHAPES:
            continue
        base = {"finite_strain": 1.0}
        found += _round([shape], seed + 3000 + 500 * i, controls=12 if many else 3, named=CHEAP,
                        strengths=(1.0, 2.0, 4.0) if many else (1.0 + i % 2,), base=base)  # fmt: skip
        found += _solid(shape, seed + 6000 + 500 * i, (0.5, 1.0, 2.0) if many else (1.0,), neo_hookean=many)
    order = np.random.default_rng(1).permutation(len(found))
    return [found[i] for i in order]


def _round(
    shapes: list[str],
    seed: int,
    *,
    controls: int,
    named: tuple[str, ...],
    strengths: tuple[float, ...],
    base: dict[str, float] | None = None,
) -> list[Case]:
    found: list[Case] = []
    base = base or {}
    for shape in shapes:
        for _ in range(controls):
            found.append(Case("control", shape, seed + len(found), (), dict(base)))
        for strength in strengths:
            for name in named:
                effects = {**base, name: strength}
                found.append(Case("single", shape, seed + len(found), (name,), effects))
    return found


def _hard(shape: str, seed: int) -> list[Case]:
    """Left out of the library, absent from it, and two at a time."""
    found: list[Case] = []
    for name in CHEAP:
        if name != "surface_offset":
            found.append(Case("left-out", shape, seed + len(found), (name,), {name: 2.0}, name))
    for strength in (1.0, 2.0, 4.0):
        effects = {"poroelasticity": strength}
        found.append(Case("absent", shape, seed + len(found), ("poroelasticity",), effects))
    for name in ("plasticity", "anisotropy"):
        effects = {"finite_strain": 1.0, name: 1.0}
        found.append(Case("absent", shape, seed + len(found), (name,), effects, protocol="brief"))
    for pair in PAIRS:
        found.append(Case("pair", shape, seed + len(found), pair, dict.fromkeys(pair, 1.5)))
    return found


def _solid(shape: str, seed: int, strengths: tuple[float, ...], *, neo_hookean: bool) -> list[Case]:
    """Effects that are solved in the solid, on the linear object and, if asked for, on the neo-Hookean."""
    found: list[Case] = []
    for name in SOLID:
        for strength in strengths:
            for base in ({}, {"finite_strain": 1.0}) if neo_hookean else ({},):
                if name in NEED_FINITE and not base:
                    continue
                effects = {**base, name: strength}
                found.append(Case("single", shape, seed + len(found), (name,), effects))
    return found
