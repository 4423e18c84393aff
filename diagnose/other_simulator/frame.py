"""In which axes and unit another simulator's forces are written, weighed against the measured ones.

Before any flaw is looked for: forces in a frame with y up look like a tip that falls through, and
millinewtons like a mesh a thousand times too stiff.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from palpate.mechanics.errors import OptionError
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.quantities import parse_unit

AS_RECORDED = "x,y,z"
SURE = 0.9
"""Nine to one: what is likelier is taken and said, what is not is asked."""
UNITS = ("N", "mN", "kN", "gf", "kgf", "lbf")
_OTHER_AXES, _OTHER_UNIT = 0.01, 0.1
"""How often files come in other axes, or in another unit, before they are looked at."""
_MIRRORED = 0.25
"""Share of those that are mirrored, as left-handed frames are."""
_DIRECTION = 0.01
"""Mean square by which a right simulation's directions are off; flaws are looked for later."""
_NEAR, _FAR = 0.1, 1.1
"""Standard deviations of the logarithm of a simulation's level: half are near the measured one."""


@dataclass(frozen=True)
class ForceFormat:
    """How a file's forces are written. axes: which of the recording's axes its fx, fy, fz are ("x,z,-y": y
    up). unit: of UNITS. notes: what was found of them, in words."""

    axes: str = AS_RECORDED
    unit: str = "N"
    notes: tuple[str, ...] = ()

    def newtons(self, force: np.ndarray) -> np.ndarray:
        """(n, 3) N in the recording's axes, of the file's own numbers (n, 3)."""
        return force @ turned(self.axes) * parse_unit(self.unit).scale


def turned(axes: str) -> np.ndarray:
    """(3, 3), its rows a file's fx, fy, fz in the recording's axes; raises OptionError for other text."""
    names = [each.strip().lower() for each in axes.split(",")]
    matrix = np.zeros((3, 3))
    if sorted(name.lstrip("+-") for name in names) != ["x", "y", "z"] or max(map(len, names)) > 2:
        raise OptionError(
            f"--simulated-axes '{axes}' must say which of the recording's axes the file's fx, fy and fz are: "
            "x,z,-y where the file has y up"
        )
    for row, name in zip(matrix, names, strict=True):
        row["xyz".index(name[-1])] = -1.0 if name[0] == "-" else 1.0
    return matrix


def _every() -> tuple[str, ...]:
    """The 48 ways in which axes can be turned and mirrored; as recorded first, then y up."""
    first = (AS_RECORDED, "x,z,-y", "x,-z,y")
    signs = list(itertools.product(("", "-"), repeat=3))
    every = (
        ",".join(s + a for s, a in zip(sign, order, strict=True))
        for order in itertools.permutations("xyz")
        for sign in signs
    )
    return tuple(dict.fromkeys((*first, *every)))


def weighed_frame(
    force: np.ndarray, presses: Presses, rows: np.ndarray, *, axes: str, unit: str | None, level: float
) -> ForceFormat:
    """The frame of forces (n, 3), in the file's numbers, at the presses' rows; `rows` (n,) bool count.

    axes, unit: what was stated ("", None: nothing). level: how much stiffer than the model the simulation was
    stated to be. Raises OptionError, with the options that settle it, where the forces leave it open.
    """
    measured = (presses.force - presses.free_air)[rows]
    sites = len(np.unique(presses.site[presses.press[rows]]))
    notes = []
    if axes:
        turned(axes)
    else:
        axes, words = _axes(force[rows], measured, sites)
        notes += words
    if unit is None:
        unit, words = _unit(_ratio(force, presses, rows) / level)
        notes += words
    return ForceFormat(axes, unit, tuple(notes))


def _axes(force: np.ndarray, measured: np.ndarray, sites: int) -> tuple[str, list[str]]:
    every = _every()
    size = np.sqrt((measured**2).sum() * (force**2).sum())
    if not size > 0:
        return AS_RECORDED, []
    product = force.T @ measured
    likeness = np.array([(turned(axes) * product).sum() / size for axes in every])
    rotation = np.array([np.linalg.det(turned(axes)) > 0 for axes in every])
    prior = np.where(rotation, (1 - _MIRRORED) / 23, _MIRRORED / 24) * _OTHER_AXES
    prior[0] = 1 - _OTHER_AXES
    missed = 1 - np.maximum(likeness, 0.0) ** 2 + _DIRECTION
    odds = np.log(prior) - 0.5 * sites * np.log(missed)  # a place's presses err alike
    share = np.exp(odds - odds.max())
    share /= share.sum()
    order = np.argsort(-share, kind="stable")
    best = int(order[0])
    said = f"the file's fx, fy, fz are the recording's {every[best]}"
    against = f"likeness {likeness[order[int(best == 0)]]:.2f}, as written {likeness[0]:.2f}"
    if best == 0 and share[best] > SURE:
        return AS_RECORDED, []
    if every[best] == "-x,-y,-z":
        raise OptionError(
            f"the simulated forces point against the measured ones (cosine {likeness[0]:.2f}): is it the "
            "force on the object? State --simulated-force-on object"
        )
    if share[best] > SURE:
        return every[best], [f"{said} ({against}): another frame; --simulated-axes x,y,z keeps it as written"]
    alike = [every[i] for i in order if share[i] > 0.1 * share[best]]
    others = "" if len(alike) < 4 else f" or {len(alike) - 3} others"
    raise OptionError(
        f"the simulated forces do not point as the measured ones do ({against}): in which axes are they? "
        f"State --simulated-axes: {'; '.join(alike[:3])}{others} fit alike (x,z,-y is y up, x,y,z keeps them)"
    )


def _ratio(force: np.ndarray, presses: Presses, rows: np.ndarray) -> float:
    """How many times the measured force a file's numbers are: the median press's, where it is great."""
    measured = np.linalg.norm(presses.force - presses.free_air, axis=1)
    own = np.linalg.norm(force, axis=1)
    ratios = []
    for p in np.unique(presses.press[rows]):
        part = np.flatnonzero(rows & (presses.press == p))
        great = np.percentile(measured[part], 90)
        if great > 3 * presses.vector_noise_n:
            ratios.append(np.percentile(own[part], 90) / great)
    return float(np.median(ratios)) if ratios else float("nan")


def _unit(ratio: float) -> tuple[str, list[str]]:
    if not ratio > 0:
        return "N", []
    factor = np.array([parse_unit(unit).scale for unit in UNITS])
    prior = np.full(len(UNITS), _OTHER_UNIT / (len(UNITS) - 1))
    prior[0] = 1 - _OTHER_UNIT
    off = np.log(ratio * factor)
    share = prior * sum(np.exp(-0.5 * (off / sd) ** 2) / sd for sd in (_NEAR, _FAR))
    share /= share.sum() if share.sum() > 0 else 1.0
    best = int(np.argmax(share))
    came = f"the simulated forces are {ratio:.3g} times what is expected of newtons"
    sure = share[best] > SURE or not share.any()
    if sure and best:
        return UNITS[best], [
            f"{came}: read as {UNITS[best]}; --simulated-unit N keeps them (a modulus that is so far off)"
        ]
    likelihood = share / prior
    fitting = [i for i in np.argsort(-share, kind="stable") if i and likelihood[i] > likelihood[0]]
    if sure:
        other = [UNITS[i] for i in fitting[:1]]
        return "N", [f"{came}: kept, as of another modulus; --simulated-unit {u} reads {u}" for u in other]
    either = " or ".join(UNITS[i] for i in fitting or [best])
    raise OptionError(
        f"{came}: are they in {either}? State --simulated-unit {either}, or --simulated-unit N to keep them"
    )
