"""The cases of the blind benchmark: what is sealed, at which strengths, on which objects, in whose hand.

Everything that is no question is drawn by the case's seed from `benchmarks.varied`: frame, hand, presses,
sampling, noise, what the file states and how it is written.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from benchmarks.varied.draws import Draw, draw
from benchmarks.varied.shapes import FAMILIES
from palpate.mechanics.errors import OptionError

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
"""Effects for which every touch is solved anew (minutes)."""
NEED_FINITE = ("strain_stiffening", "mullins_softening", "plasticity", "anisotropy")
REMEMBERING = ("mullins_softening", "plasticity")
"""Effects for which every touch of a place is solved in its turn."""
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
WEIGHT = ("tool_gravity_inertia", "force_bias")
"""What a tool's own weight is: the one where its orientation is known, a constant force where it is not."""
FINITE = "finite_strain"
SEEDS = {"development": 0, "calibration": 60_000, "evaluation": 70_000}
"""First seeds. Rules may be chosen on the first; the second are fitted to and not looked at; the third is
opened once a release, and docs/evidence/blind-benchmark.md has a line for every opening."""
POOLS = {
    "quick": (0, 3),
    "protocol": (0, 1, 2, 3, 4, 5),
    "medium": (0, 1, 2, 3, 4, 5),
    "full": tuple(range(len(FAMILIES))),
}
"""Objects of `benchmarks.varied` that the cases of a size choose from, each solved once as it is, ..."""
NEO_HOOKEAN = {"quick": (), "protocol": (), "medium": (0, 2), "full": (0, 1, 2, 3)}
"""... and those that are solved once more as neo-Hookean solids."""
PROTOCOLS = ("ordinary", "complete")
"""How the cases of size `protocol` are explored, each case both ways: traced and pressed; and then the bare
support pressed, the tool waved, the base traced once more (`palpate simulate --protocol complete`)."""
HIDDEN = ("tool_compliance", "surface_offset")
"""What a surface and a modulus that are fitted to the same presses hide."""
ALIKE = ("time_delay", "backlash", "viscoelasticity")
"""Effects that bend loops much alike."""
FEWER_PRESSES = 14
"""At most so many presses where the solid remembers them."""


@dataclass(frozen=True)
class Case:
    """One question: `tested` names what is asked for (empty: nothing is wrong), `effects` all that acts.

    `effects` is `tested` and, on a neo-Hookean object, finite strain, which belongs in the answer but is no
    question. without: left out of the library. number: of the object. protocol: of PROTOCOLS, where that is
    the question. All nuisances follow from the seed.
    """

    kind: str
    number: int
    seed: int
    tested: tuple[str, ...] = ()
    effects: dict[str, float] = field(default_factory=dict)
    without: str = ""
    protocol: str = ""

    @property
    def recording(self) -> str:
        """A file name for what is recorded."""
        effects = "+".join(f"{k}={v:g}" for k, v in self.effects.items()) or "none"
        name = f"{self.family}-{self.number}-{effects}-{self.seed}"
        return f"{name}-{self.protocol}" if self.protocol else name

    @property
    def key(self) -> str:
        """A file name for the answer."""
        return self.recording + (f"-without-{self.without}" if self.without else "")

    @property
    def family(self) -> str:
        """Of shapes."""
        return list(FAMILIES)[self.number % len(FAMILIES)]

    @property
    def nuisances(self) -> Draw:
        """What the seed draws. A tool whose weight or bias is the question has no mass of its own beside, and
        a solid that remembers is pressed less often.
        """
        drawn = replace(draw(self.seed), number=self.number)
        if any(name in WEIGHT for name in self.tested):
            drawn = replace(drawn, tool_mass_kg=0.0)
        if any(name in REMEMBERING for name in self.effects):
            drawn = replace(drawn, presses=min(drawn.presses, FEWER_PRESSES))
        if self.protocol:
            drawn = replace(drawn, ends_in_contact=False)
        return drawn

    @property
    def beside(self) -> tuple[str, ...]:
        """Names that are true of the recording and no question: neither asked for nor false."""
        found = [name for name in self.effects if name not in self.tested]
        if self.nuisances.tool_mass_kg > 0:
            found += WEIGHT
        return tuple(found)

    def as_json(self) -> dict[str, Any]:
        """Plain."""
        return {**asdict(self), "tested": list(self.tested), "beside": list(self.beside)}


def cases(size: str, families: Sequence[str] | None, seed: int) -> list[Case]:
    """All cases of a size, shuffled, so that a run that stops early is a fair sample of it.

    quick: a few instrument effects. protocol: what presses alone hide or mix up, and controls, explored in
    two ways. medium: controls, every cheap effect at four strengths, left out, absent,
    pairs; every cheap effect on two neo-Hookean objects; solid effects on linear ones. full: more controls
    and strengths, all families, solid effects on neo-Hookean objects. families: of shapes, by default all of
    the size's pool. Raises OptionError for a family that no shape of the pool has.
    """
    pool, finite = (_of_families(which[size], families) for which in (POOLS, NEO_HOOKEAN))
    if not pool:
        known = ", ".join(list(FAMILIES)[number] for number in POOLS[size])
        asked = " or ".join(families or ())
        raise OptionError(f"no object of the {size} size is a {asked}: there are {known}")
    if size == "quick":
        return _round(pool, seed, controls=2, named=CHEAP[:6], strengths=(1.0,))
    if size == "protocol":
        return _both_ways(pool, seed)
    many = size == "full"
    strengths = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0) if many else (0.5, 1.0, 2.0, 4.0)
    found = _round(pool, seed, controls=150 if many else 36, named=CHEAP, strengths=strengths)
    found += _hard(pool, finite, seed + 2000)
    for i, number in enumerate(finite):
        levels = (1.0, 2.0, 4.0) if many else (1.0 + i % 2,)
        found += _round((number,), seed + 3000 + 500 * i, controls=12 if many else 3, named=CHEAP,
                        strengths=levels, base={FINITE: 1.0})  # fmt: skip
        found += _round((number,), seed + 9500 + 100 * i, controls=0 if many else 9, named=(), strengths=(),
                        base={FINITE: 1.0})  # fmt: skip
    found += _round(pool, seed + 9000, controls=0 if many else 90, named=(), strengths=())
    for i in range(4 if many else 2):
        found += _solid(pool, finite, seed + 6000 + 500 * i, (0.5, 1.0, 2.0) if many else (1.0,),
                        neo_hookean=many)  # fmt: skip
    order = np.random.default_rng(1).permutation(len(found))
    return [found[i] for i in order]


def _both_ways(pool: Sequence[int], seed: int) -> list[Case]:
    """Each case explored by each protocol, side by side."""
    wanted = [(name, s) for s in (0.5, 1.0, 2.0) * 2 for name in HIDDEN]
    wanted += [(name, s) for s in (0.5, 1.0, 2.0, 4.0) for name in ALIKE]
    wanted += [("", 0.0)] * 12
    found = []
    for number, (name, strength) in enumerate(wanted, start=seed + 8000):
        kind, tested = ("single", (name,)) if name else ("control", ())
        where = _one_of(pool, number)
        effects = {name: strength} if name else {}
        found += [Case(kind, where, number, tested, effects, protocol=way) for way in PROTOCOLS]
    return found


def _of_families(numbers: Sequence[int], families: Sequence[str] | None) -> tuple[int, ...]:
    names = list(FAMILIES)
    return tuple(n for n in numbers if not families or names[n % len(names)] in families)


def _one_of(pool: Sequence[int], seed: int) -> int:
    return int(np.random.default_rng([13, seed]).choice(pool))


def _round(
    pool: Sequence[int],
    seed: int,
    *,
    controls: int,
    named: tuple[str, ...],
    strengths: tuple[float, ...],
    base: dict[str, float] | None = None,
) -> list[Case]:
    wanted: list[tuple[str, tuple[str, ...], dict[str, float]]] = [("control", (), {})] * controls
    wanted += [("single", (name,), {name: strength}) for strength in strengths for name in named]
    return [
        Case(kind, _one_of(pool, seed + i), seed + i, tested, {**(base or {}), **effects})
        for i, (kind, tested, effects) in enumerate(wanted)
    ]


def _hard(pool: Sequence[int], finite: Sequence[int], seed: int) -> list[Case]:
    """Left out of the library, absent from it, and two at a time."""
    found: list[Case] = []

    def add(kind: str, tested: tuple[str, ...], effects: dict[str, float], without: str = "") -> None:
        of = finite if FINITE in effects else pool
        if of:
            number = seed + len(found)
            found.append(Case(kind, _one_of(of, number), number, tested, effects, without))

    for name in CHEAP:
        if name != "surface_offset":
            add("left-out", (name,), {name: 2.0}, name)
    for strength in (1.0, 2.0, 4.0):
        add("single", ("poroelasticity",), {"poroelasticity": strength})
    for name in ("plasticity", "anisotropy"):
        add("absent", (name,), {FINITE: 1.0, name: 1.0})
    for pair in PAIRS:
        add("pair", pair, dict.fromkeys(pair, 1.5))
    return found


def _solid(
    pool: Sequence[int], finite: Sequence[int], seed: int, strengths: tuple[float, ...], *, neo_hookean: bool
) -> list[Case]:
    """Effects that are solved in the solid, on a linear object and, if asked for, on a neo-Hookean one."""
    found: list[Case] = []
    for name in SOLID:
        for strength in strengths:
            for base in ({}, {FINITE: 1.0}) if neo_hookean and finite else ({},):
                if name in NEED_FINITE and not base:
                    continue
                number = seed + len(found)
                where = _one_of(finite if base else pool, number)
                found.append(Case("single", where, number, (name,), {**base, name: strength}))
    return found
