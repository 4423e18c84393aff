"""When the base is traced: the tip slides on the rigid support, in one plane (paper, section 2.1)."""

from __future__ import annotations

import numpy as np

from palpate.mechanics.errors import NoBaseError
from palpate.mechanics.recording.segments import runs
from palpate.reconstruction.shapes.points import FLAT, fit_plane

_LEAST_SLIDE = 8.0  # tip radii; a drag within a palpation is shorter or leaves the plane
_LEAST_PIECE = 2.0  # tip radii; less tells no plane
_MOMENT_S = 0.05  # a contact that is shorter is no press
_BREAK_S = 2.5  # longer than a tracing is broken off
_THINNED = 5  # samples


def find_interval(
    t: np.ndarray,
    position: np.ndarray,
    touching: np.ndarray,
    given: tuple[float, float] | None,
    tip_radius_m: float,
) -> tuple[int, int]:
    """Sample indices [first, last) of phase I.

    given: approximate times from the recording; contact that starts inside is followed to its end. Without
    them: contacts in which the tip slides further than 8 radii while it stays in one plane, until one leaves
    that plane for good. touching: (n,) bool. Raises ContactError where there is none.
    """
    found = runs(touching)
    if given is not None:
        inside = [(a, b) for a, b in found if t[min(b, len(t) - 1)] > given[0] and t[a] < given[1]]
        inside = [(a, b) for a, b in inside if _travel(position[a:b]) > 2 * tip_radius_m]
        if not inside:
            raise NoBaseError(
                f"no contact with the support between {given[0]:.2f} and {given[1]:.2f} s (boundary_phase): "
                "trace the object's base first, or give [object] model = PATH of a model whose base stands in"
            )
        return inside[0][0], inside[-1][1]
    for i, (a, b) in enumerate(found):
        if _travel(position[a:b]) < _LEAST_PIECE * tip_radius_m:
            continue
        centre, normal, flatness = fit_plane(position[a:b])
        if flatness > FLAT * tip_radius_m:
            continue
        first, last = _coplanar(t, position, found, i, tip_radius_m)
        if sum(_travel(position[c:d]) for c, d in found[first : last + 1]) > _LEAST_SLIDE * tip_radius_m:
            return found[first][0], found[last][1]
    raise NoBaseError(
        "no boundary phase found: nowhere does the tip slide further than 8 of its radii in one plane; trace "
        "the object's base first, state [recording] boundary_phase, or give [object] model = PATH of a "
        "model whose base stands in"
    )


def _coplanar(
    t: np.ndarray, position: np.ndarray, found: list[tuple[int, int]], start: int, tip_radius_m: float
) -> tuple[int, int]:
    """First and last of the contacts around `start` that lie in one plane with it, none left out between.

    The plane is fitted anew with each contact that is tried: one straight side of a foot alone tells no
    plane. A contact of a moment, as of a tip that bounces, ends nothing; nor does one that slides nowhere and
    stays within a tip's radius of the plane, as of a tip that is lifted along the object's wall, or comes so
    soon that it may be the swing of a heavy tool while the tracing is broken off.
    """
    lasting = [k for k, (a, b) in enumerate(found) if k == start or t[b - 1] - t[a] > _MOMENT_S]
    at = lasting.index(start)
    low = high = at

    def thinned(k: int) -> np.ndarray:
        a, b = found[lasting[k]]
        return position[a:b:_THINNED]

    def off(pieces: list[np.ndarray], of: list[np.ndarray]) -> float:
        """m, the most by which the middle of any piece is off the plane of some."""
        centre, normal, _ = fit_plane(np.concatenate(of))
        return max(float(np.median(np.abs((piece - centre) @ normal))) for piece in pieces)

    def apart(k: int, other: int) -> float:
        """s between two contacts."""
        early, late = found[lasting[min(k, other)]], found[lasting[max(k, other)]]
        return float(t[late[0]] - t[early[1] - 1])

    pieces = [thinned(at)]
    for step in (1, -1):
        tried = at
        while 0 <= (tried := tried + step) < len(lasting):
            own = thinned(tried)
            together = [*pieces, own]
            if off(together, together) <= FLAT * tip_radius_m:
                pieces, low, high = together, min(low, tried), max(high, tried)
            elif _travel(position[slice(*found[lasting[tried]])]) > _LEAST_PIECE * tip_radius_m:
                break
            elif apart(tried, high if step > 0 else low) > _BREAK_S and off([own], pieces) > tip_radius_m:
                break
    return lasting[low], lasting[high]


def _travel(points: np.ndarray) -> float:
    # positions come in steps, so the path is measured on every 50th sample
    return float(np.linalg.norm(np.diff(points[::50], axis=0), axis=1).sum()) if len(points) > 50 else 0.0
