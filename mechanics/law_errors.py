"""Our own errors: how wrong our law of a touch may be, by place, by depth and by slip. One table for all.

A class is one error. Its entries are the widths that its readers take, each named after the reader; where
they differ they stand beside one another, with their reasons. What a user may tune is an option, whose
default is read here.

Not here: what a fitted value of an effect may be off by (its own `hints.systematic`), what an instrument or
the rigid support reads wrongly (diagnose/instrument, diagnose/calibrate/on_plate.py), and how a shape may run
where nobody touched it (reconstruct, render/surface/snapping.py).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Reach = Literal["sample", "press", "place", "neighbours", "all places"]
"""Within what an error is one number: it is drawn anew for the next sample, press, place; or for none."""

_SET = "set by hand, no measurement is on record"
_DIAGNOSIS = f"{_SET} (docs/decisions/0080); the weights of naming were fitted with it"
_EXPLORING = f"{_SET}; without errors that places share, sound silicones lose 'none' (docs/decisions/0150)"
_PLANNING = f"{_SET}; it ranks touches that are still to be made (docs/decisions/0150)"
_SIMULATOR = f"{_SET}; names were tested on sealed flaws with it (`palpate bench simulated`)"
_PIECES = f"{_SET}, for a machine's curves at the size of a hand (docs/decisions/0120)"
_CONTROLS = (
    "within 95 % of what 74 sound objects of the laboratory say: 0.7 to 1 of the bound, 0.4 to 1.2 of the "
    "surface's error (`palpate bench places`)"
)
_FITTED = (
    "nine drawn in the laboratory: over what a surface states of itself (0.03 to 0.37 mm), it lies off the "
    "true one by 1.1 (rms over recordings) on the whole and by 0.57 from place to place"
)
_FLOOR = f"{_SET}: what a surface of few numbers may miss of a real one, beside what it states"
_SOLVED_SIDEWAYS = (
    "sound objects drawn by other solvers hold 0.77 of the law sideways at 0.2 tip radii of depth, 0.92 at "
    "0.4, 0.97 beyond"
)
_BOUND = "fitted to solved presses at places of known shapes (`palpate bench law-bound`)"


@dataclass(frozen=True)
class OwnError:
    """value: in `unit` (spelt as mechanics.quantities parses it), one standard deviation unless `of` says
    otherwise. of: what is wrong by that much; a share is one of the force. reach: within what it is one
    number. source: where the value comes from."""

    value: float
    unit: str
    of: str
    reach: Reach
    source: str


class FirstTouch:
    """Where a press first touches, along the normal."""

    diagnosis = OwnError(0.2e-3, "m", "first touch of a press", "press", _DIAGNOSIS)
    fitted = OwnError(
        0.05e-3, "m", "first touch on a surface that was fitted to the presses", "press", _FLOOR
    )
    fitted_share = OwnError(
        0.6, "1", "first touch on such a surface, of the surface's own stated error", "press", _FITTED
    )
    fitted_common = OwnError(0.1e-3, "m", "first touches on such a surface", "all places", _FLOOR)
    simulator = OwnError(
        0.1e-3, "m", "first touch on the surface that a simulator was given too", "press", _SIMULATOR
    )
    pieces = OwnError(
        0.5e-3, "m", "first touch by a machine: its zero is worth what its load is", "press", _PIECES
    )
    next_touch = OwnError(0.2e-3, "m", "first touch that is still to be made", "press", _PLANNING)
    felt_surface = OwnError(
        6e-5, "m", "first touch, as the felt surface is drawn through it", "press",
        f"{_SET}; docs/decisions/0021 says how first touch is found",
    )  # fmt: skip
    common = OwnError(0.05e-3, "m", "first touches of all presses together", "all places", _EXPLORING)
    tails = OwnError(
        3.0, "1", "first touch on a running shape: degrees of freedom of Student's t", "press",
        f"{_SET}; such a shape passes single touches by millimetres (docs/decisions/0150)",
    )  # fmt: skip


class Stiffness:
    """Share by which a place pushes back too much or too little, whatever the depth: law, mesh, shape."""

    diagnosis = OwnError(
        0.03, "1", "stiffness of a place whose bound is not known: a running shape, a machine's curves",
        "place", _DIAGNOSIS,
    )  # fmt: skip
    bound = OwnError(
        0.8, "1", "stiffness of a place that is not solved, in standard deviations of the law's bound there",
        "place", _CONTROLS,
    )  # fmt: skip
    simulator = OwnError(
        0.03, "1", "stiffness on the surface that a simulator was given too", "place", _SIMULATOR
    )
    next_touch = OwnError(
        0.05, "1", "modulus of a press that is still to be made, by law and shape", "neighbours", _PLANNING
    )
    solved = OwnError(
        0.008, "1", "force at a place that is solved, in place of any greater share of the law", "place",
        "finer elements, shorter steps, a stiffer contact and a larger zone move a solution by this much "
        "together (`palpate bench press-solver --convergence`)",
    )  # fmt: skip
    surface = OwnError(
        1.0, "1", "relative stiffness a unit of the surface's error over the object's height", "place",
        _CONTROLS,
    )  # fmt: skip
    running_surface = OwnError(
        2.5, "1", "the same of a surface that is still being explored; edges near a press count double",
        "place", _SET,
    )  # fmt: skip
    shared_over = OwnError(
        0.03, "m", "distance over which neighbours share the stiffness of a place", "neighbours", _EXPLORING
    )


class Repeats:
    """Share by which presses of one place differ in stiffness."""

    diagnosis = OwnError(0.01, "1", "stiffness of a press compared with its repeats", "press", _DIAGNOSIS)
    verdict = OwnError(
        0.01, "1", "stiffness of a place, in addition to noise: the option does not tune it", "press", _SET
    )
    simulator = OwnError(
        0.005, "1", "stiffness of a simulated press compared with its repeats", "press", _SIMULATOR
    )
    pieces = OwnError(0.07, "1", "stiffness of pieces, one a press", "press", _PIECES)


class Level:
    """Share by which all places push back too much or too little alike; a fitted modulus takes it up."""

    modulus = OwnError(
        0.02, "1", "a fitted modulus: law and mesh", "all places",
        "two independent simulators differ by this much: docs/decisions/0020",
    )  # fmt: skip
    field = OwnError(0.02, "1", "level of a fitted field of the modulus", "all places", "as of a modulus")
    calibration = OwnError(0.02, "1", "known modulus of what calibrates a tool", "all places", _SET)
    simulator = OwnError(
        0.05, "1", "force at stated parameters: a stiffness within it is no mesh's", "all places", _SIMULATOR
    )


class DepthLaw:
    """How the force grows with the depth."""

    diagnosis = OwnError(
        0.02, "1", "bend of a place's law over the depth reached, where it is not solved", "place", _DIAGNOSIS
    )
    simulator = OwnError(0.03, "1", "bend of a place's law, against a simulator", "place", _SIMULATOR)
    pieces = OwnError(
        0.1, "1", "bend of the law: pieces differ in more than their stiffness", "place", _PIECES
    )
    common = OwnError(0.03, "1", "bend of the law of all places together", "all places", _EXPLORING)
    modulus = OwnError(0.03, "1", "force of a sample that a modulus is fitted to", "sample", _SET)
    field = OwnError(0.03, "1", "force of a sample, for a field or a comparison of models", "sample", _SET)


class FiniteStrain:
    """What small-strain elasticity misses in deep presses."""

    coefficient = OwnError(
        0.032, "1", "share of the force at a depth of one tip radius", "all places",
        "full solves in labelled recordings: 1.4 % (rms) at 3 to 4 mm, 6 % at 4 to 8 mm, tip of 5 mm",
    )  # fmt: skip
    exponent = OwnError(2.4, "1", "power of depth over tip radius", "all places", "as the coefficient")
    common = OwnError(
        0.6, "1", "share of what finite strain changes, by its own law", "all places", _EXPLORING
    )


class Direction:
    """Where the push along the normal points."""

    diagnosis = OwnError(0.03, "rad", "normal of a place", "place", _DIAGNOSIS)
    turned = OwnError(0.02, "rad", "forces turned about each axis of the device", "all places", _EXPLORING)
    upward = OwnError(
        0.03, "1", "share of the push that goes up or down along the surface", "all places", _EXPLORING
    )


class Slip:
    """Share by which the force along the surface is wrong: how far the tip sticks."""

    diagnosis = OwnError(0.25, "1", "force along the surface, of itself", "press", _DIAGNOSIS)
    leaning = OwnError(
        0.5, "1", "force along the surface beyond the force along the normal, of a tip that sticks", "sample",
        "a tip dragged 3.7 mm over a dome and drawn out, in the laboratory: at 0.5 mm of depth the law holds "
        "1.35 N aside beside 0.3 N, where 0.36 N are solved",
    )  # fmt: skip
    level = OwnError(
        0.05, "1", "ln of how a dent holds sideways, in a diagnosis", "all places",
        "at 0.15 a skin is taken up by it, at 0 a sound silicone gets one (docs/decisions/0080)",
    )  # fmt: skip
    shallow = OwnError(
        0.3, "1", "the same of the shallowest dents, beside `level`", "all places", _SOLVED_SIDEWAYS
    )
    shallow_over = OwnError(
        0.25, "1", "depth, in tip radii, over which `shallow` fades", "all places", _SOLVED_SIDEWAYS
    )
    common = OwnError(
        0.15, "1", "force along the surface of all presses, of itself", "all places", _EXPLORING
    )


class Latency:
    """When the force is read."""

    diagnosis = OwnError(
        0.5e-3, "s", "time of the force relative to the position", "press",
        "of 20 sound objects without it one is said to read late, by a thousandth of its force",
    )  # fmt: skip
    common = OwnError(0.5e-3, "s", "time of the force relative to the position", "all places", _EXPLORING)


class Unnamed:
    """What no error above covers, drawn anew at every thinned sample."""

    share = OwnError(
        0.005, "1", "force in proportion to itself", "sample",
        "of 10 sound objects of the laboratory (elements of 1.5 mm) and 3 of another simulator none has a "
        "lack of fit above 0.95 by it, and none is given a cause",
    )  # fmt: skip
    alike = OwnError(
        0.0018, "1", "force in proportion to itself, in a form without a loop that bends the law of all "
        "presses alike", "all places",
        "what is not there changes the force of sound objects by 0.2 % (17 nats, a silicone of another "
        "simulator) to 0.7 % (13 nats, a sphere's cap of the laboratory); by this width 0.7 % hold 8 nats",
    )  # fmt: skip
    along = OwnError(
        6.25, "1", "variance of that share in a sum along a press, over that of one anew at each sample",
        "press",
        "at a force of 300 times the noise a sound kidney's false causes gain up to 34 nats with 1, 7 with "
        "6; causes that are there lose a fifth",
    )  # fmt: skip
    along_simulator = OwnError(1.0, "1", "the same against a simulator", "press", _SIMULATOR)
    share_exploring = OwnError(
        0.0, "1", "force in proportion to itself, in exploring", "sample",
        "'none' holds what is small against the force already (docs/decisions/0150)",
    )  # fmt: skip
    share_simulator = OwnError(
        0.015, "1", "force in proportion to itself, against a simulator", "sample", _SIMULATOR
    )
    share_curves = OwnError(
        0.0, "1", "force in proportion to itself, of a machine's curve", "sample",
        "what no name covers is a share of the peak there",
    )  # fmt: skip
    force = OwnError(0.002, "N", "a component of the force", "sample", _DIAGNOSIS)
    force_simulator = OwnError(
        0.001, "N", "a component of a simulator's force, which no sensor reads", "sample", _SIMULATOR
    )
    peak_one_piece = OwnError(0.005, "1", "force over the peak, of curves of one piece", "sample", _PIECES)
    peak_pieces = OwnError(0.02, "1", "force over the peak, of curves of several pieces", "sample", _PIECES)


class Smallest:
    """Share of the typical force that a change must have to be given a name: our law is no better."""

    exploring = OwnError(
        0.01, "1", "change that may be a cause", "all places",
        "of 75 controls 7 lose 'none' and 22 of 23 causes stand; with 2 % 5 and 18 (docs/decisions/0150)",
    )  # fmt: skip
    simulator = OwnError(0.02, "1", "change that may be a simulator's flaw", "all places", _SIMULATOR)


class Bound:
    """Half widths of 95 % intervals of a rendered force, squared and added: a share of the force a unit of
    what `of` names (render.force_error.place_numbers).

    Of 317 presses at 32 places of eight shapes (`palpate bench law-bound`, seed 41) 3.5 % lie beyond, beside
    a plate's rim and at the lip of a waist, where the law is up to 13 % too soft. At 0.3 mm from a block's
    rim it is 18 % too soft a tenth of a radius deep.
    """

    floor = OwnError(0.02, "1", "95 %: anywhere", "place", _BOUND)
    deep = OwnError(0.02, "1", "95 %: depth, in tip radii", "place", _BOUND)
    bent = OwnError(0.03, "1", "95 %: |curvature| times depth", "place", _BOUND)
    uneven = OwnError(
        1.2, "1", "95 %: curvature under the middle of a contact less that over all of it", "place",
        "set by a place of the tongue of `palpate bench mesh-zoo`, in a groove as narrow as the tip: the law "
        "is 24 % too soft at a fifteenth of the tip's radius, 15 % at four tenths",
    )  # fmt: skip
    wall = OwnError(
        1.25, "1", "95 %: squared, a contact's width over the wall's thickness, with air behind", "place",
        "set by two places of `palpate bench mesh-zoo`: the law is 33 % too hard on a shell of 4 mm, 13 % on "
        "a tube of 5 mm, with tips of 4.8 mm",
    )  # fmt: skip
    coarse = OwnError(
        1.4, "1", "95 %: rims within a patch wider than the usual one, over its width in tip radii, times "
        "the root of the depth", "place",
        "set by three places of `palpate bench mesh-zoo` beside rims of a block of 500 mm, whose elements of "
        "38 mm are too many to halve: the law is 4 to 23 % too hard",
    )  # fmt: skip
    foot = OwnError(
        0.5, "1", "95 %: how much of a patch on a flank would lie below the base's outline, over its width "
        "in tip radii, times the root of the depth", "place",
        "linear solves at ten heights over the bases of a block and a beam of `palpate bench mesh-zoo` say "
        "0.3 to 0.4, a solved press on that beam, where the law is 2 to 4 % too soft, 0.5",
    )  # fmt: skip
    sideways = OwnError(0.1, "1", "95 %: the surface's way sideways under a push", "place", _BOUND)
    rim = OwnError(0.2, "1", "95 %: how near a rim is", "place", _BOUND)
    late = OwnError(
        0.5, "1", "95 %: by Hertz, what a tip overlaps beside a sharp rim before it is felt, as the contact "
        "normal turns there", "sample",
        "a right-angled rim is 0.36 to 0.58 times as stiff as plane ground: solved presses at the rims "
        "of a block and a cylinder, where the law is 59 % too soft a thirtieth of a radius deep",
    )  # fmt: skip
    edge = OwnError(
        0.64, "1", "95 %: of a dent with nothing in it, the tip on a sharp rim between its faces", "sample",
        "the law takes plane ground, up to 2.8 times as stiff; solved presses into two such rims",
    )  # fmt: skip
    dented = OwnError(0.1, "1", "depth, in tip radii, over which `edge` fades", "sample", "the same presses")
    base = OwnError(0.6, "1", "95 %: how near the base is", "place", _BOUND)
    ratio = OwnError(0.25, "1", "95 %: Poisson's ratio below the usual one", "place", _BOUND)
    rough = OwnError(
        0.1, "1", "95 %: of a first table by a mesh's own elements, which are not halved", "place",
        "beyond the first table of halved elements 10 % on a block and 7 % on a cylinder of `palpate bench "
        "mesh-zoo`, of 5,000 to 6,000 nodes; 1.1 and 0.2 % on livers of 9,600 and 15,000",
    )  # fmt: skip
    slip = OwnError(0.05, "1", "95 %: depth, in tip radii, of a tip without friction", "place", _BOUND)
    slippery = OwnError(0.15, "1", "coefficient of friction over which `slip` fades", "place", _BOUND)
