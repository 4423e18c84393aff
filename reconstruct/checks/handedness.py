"""One test of the map from motion to force: pressing must push back against the way that the tip has gone.

For a touch that sticks, the force on the tool points against its travel since first touch, to within friction
and the surface's slope. Of all maps that a wrong axis, sign or handedness makes (the 48 signed permutations,
and |force| a component) the one under which forces are most nearly where they must be is compared with the
identity, sites weighed alike. Only touches that press count, from which the tip comes back; where it slides
as well, its force must lie no more along the way under that map than as read: it stands on the surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations, product

import numpy as np

from palpate.mechanics.presses.repeats import SITE_M, sites_of
from palpate.reconstruction.checks.finding import ALL_THE_SAME, SURE_ODDS, Finding, Way
from palpate.reconstruction.checks.samples import Samples

_LEAST_SITES = 5
_LEAST_ANGLE_RAD = 0.15
"""Directions of force and of travel agree no better than this on a sound recording."""
_FLIPPED, _PRIOR = np.pi / 2, 1e-3
_FORCE = ("fx", "fy", "fz")
_COMES_BACK = 0.5
"""Of its greatest distance from first touch: a press lets go nearer than that, a slide farther."""
_SLIDE_S, _SLIDE_RADII, _STEADY = 0.2, 0.4, 0.4
"""The tip slides where it goes so many radii in that time and its force changes by less than that share: a
press that goes in or out as far changes it by more."""
_LENGTHWAYS = 0.1
"""Mean share of its force along the way of a slide that friction and surfaces that lean bring about."""


def handedness(data: Samples) -> Iterator[Finding]:
    """A finding where another map than the identity explains the forces' directions far better."""
    touches = data.touches
    length, force = np.linalg.norm(touches.travel, axis=1), np.linalg.norm(touches.push, axis=1)
    good = (length > 5 * max(float(data.step[:3].max()), 1e-6)) & (force > 0) & _presses(data)
    if good.sum() < _LEAST_SITES:
        return
    against = -touches.travel[good] / length[good, None]
    push = touches.push[good] / force[good, None]
    site = sites_of(data.path[touches.start[good]], against, SITE_M)
    share = 1.0 / np.bincount(site)[site]
    sites = int(site.max()) + 1
    if sites < _LEAST_SITES:
        return

    def astray(expected: np.ndarray) -> float:
        """Mean of 1 - cos of the angle between expected and read direction, sites alike."""
        off = 1 - np.einsum("ij,ij->i", push, expected)
        return float((share * off).sum() / sites) + 0.5 * _LEAST_ANGLE_RAD**2

    as_read = astray(against)
    found = {name: astray(against @ matrix.T) for name, matrix in _MAPS.items()}
    found["abs"] = astray(np.abs(against))
    best = min(found, key=lambda name: found[name])
    decades = sites * float(np.log10(as_read / found[best])) + np.log10(_PRIOR)
    if decades < np.log10(SURE_ODDS) or not slides_agree(data, best):
        return
    off = np.arccos(np.clip(np.einsum("ij,ij->i", push, against), -1, 1))
    worst = int(np.flatnonzero(good)[np.argmax(off)])
    stretch = data.touches.start[worst], data.touches.end[worst] - 1
    name, words, todo = _described(best)
    stated = dict(data.recording.description.get("recording") or {}).get("force_on", "tool")
    whose = "tool" if stated == "object" else "object"
    if best == "-x -y -z":
        todo = _other_side(whose, dict(data.recording.description.get("import") or {}).get("force_on"))
    at = [float(data.recording.t[int(i)]) for i in stretch]
    yield Finding(
        name,
        f"{words}: force and travel are {np.degrees(np.median(off)):.0f} degrees (median) from opposite, "
        f"{np.mean(off > _FLIPPED) * 100:.0f} % of {len(off)} touches push the wrong way",
        f"odds {10 ** min(decades, 99.0):.1g} to 1 over the axes as they are, {sites} sites",
        todo,
        np.inf,
        decades,
        (at[0], at[1]),
        _FORCE,
        _ways(best, whose),
    )


def _ways(best: str, whose: str) -> tuple[Way, ...]:
    """Read as it behaves; whose: the body of the other sign."""
    if best == "abs":
        return (ALL_THE_SAME,)
    if best == "-x -y -z":
        return (Way(f"it is the force on the {whose}", {"force_on": whose}), ALL_THE_SAME)
    read = {f"f{part[-1]}": f"{part[:-1]}f{axis}" for axis, part in zip("xyz", best.split(), strict=True)}
    columns = {role: name for role, name in sorted(read.items()) if role != name}
    return (Way("the columns of the force are so", {"columns": columns}), ALL_THE_SAME)


def _presses(data: Samples) -> np.ndarray:
    """(k,) bool, touches that press: the tip comes back to where it touched before it lets go."""
    found = []
    for a, b in zip(data.touches.start, data.touches.end, strict=True):
        way = np.linalg.norm(data.path[a:b] - data.path[a], axis=1)
        found.append(way[-1] < _COMES_BACK * way.max())
    return np.array(found, dtype=bool)


def slides_agree(data: Samples, best: str) -> bool:
    """Whether the force of sliding contact lies no more along its way by the map `best` than as read. True
    where nothing slides."""
    ends = np.arange(0, len(data.path), max(1, round(_SLIDE_S * data.rate_hz)))
    moved, size = np.diff(data.path[ends], axis=0), data.size[ends]
    way, changed = np.linalg.norm(moved, axis=1), np.abs(np.diff(size))
    touching = data.contact[ends[1:]] & data.contact[ends[:-1]]
    steady = changed < _STEADY * np.minimum(size[1:], size[:-1])
    sliding = touching & steady & (way > _SLIDE_RADII * data.tip_radius_m)
    if best == "abs" or sliding.sum() < _LEAST_SITES:
        return True
    along = moved[sliding] / way[sliding, None]
    force = (data.net[ends[1:]] + data.net[ends[:-1]])[sliding]
    force = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1e-300)

    def lengthways(read: np.ndarray) -> float:
        return float(np.abs(np.einsum("ij,ij->i", read, along)).mean())

    return lengthways(force @ _MAPS[best]) <= lengthways(force) + _LENGTHWAYS


def _maps() -> dict[str, np.ndarray]:
    """Signed permutations by name: 'x -y z' says what fx, fy, fz are."""
    found = {}
    for order in permutations(range(3)):
        for sign in product((1, -1), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = sign
            found[" ".join(f"{'-' if s < 0 else ''}{'xyz'[k]}" for k, s in zip(order, sign, strict=True))] = (
                matrix
            )
    del found["x y z"]
    return found


_MAPS = _maps()


def _other_side(whose: str, imported: str | None = None) -> str:
    """What to do where the force is that on the body `whose`; imported: the body that was said at import."""
    if imported:
        return (
            f"it was imported with --force-on {imported}: leave that out, and import tells it from the data"
        )
    return (
        f"it is that on the {whose}: say --force-on {whose} to palpate import or open, or "
        f'force_on = "{whose}" under [recording]'
    )


def _described(best: str) -> tuple[str, str, str]:
    """Name, words and remedy of a map."""
    if best == "abs":
        return (
            "force magnitude",
            "fx, fy, fz look like sizes without sign",
            "log the signed components of the force",
        )
    if best == "-x -y -z":
        return (
            "force sign",
            "the force pulls where it should push",
            _other_side("object"),
        )
    parts = best.split()
    words = "fx, fy, fz behave like " + ", ".join(p if p[0] == "-" else "+" + p for p in parts)
    if np.linalg.det(_MAPS[best]) < 0:
        flipped = [axis for axis, part in zip("xyz", parts, strict=True) if part == "-" + axis]
        if len(flipped) == 1 and all(p[-1] == a for p, a in zip(parts, "xyz", strict=True)):
            return (
                "mirrored",
                words,
                f"turn the sign of {flipped[0]} or of f{flipped[0]}: one of them is left-handed",
            )
        return "swapped axes", words, "swap the two force columns back: the frames differ in handedness"
    return "turned axes", words, "give position and force in one frame: they are turned against each other"
