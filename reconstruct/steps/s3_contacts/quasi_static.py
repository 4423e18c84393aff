"""Quasi-static points: positions and forces without a time, some rows a place.

The rows of one place are a press of its own kind. They tell stiffness, law and place; of rates, delay and
memory they say nothing, and forces are taken as tared. A place is pressed along its own force, or along that
of the places around it where its own force is another one (a weak press that rubs, a last row that pulls);
one whose force does not grow inwards is left out, and said.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.stats import theilslopes

from palpate.mechanics.errors import ContactError
from palpate.mechanics.presses.repeats import sites_of
from palpate.mechanics.presses.segmentation import FoundAround, FoundPresses, segment_recording
from palpate.mechanics.presses.table import Presses
from palpate.mechanics.recording.recording import Recording
from palpate.mechanics.statistics import spread_about_zero
from palpate.reconstruction.measured import Measured
from palpate.reconstruction.steps.s2_base import Boundary
from palpate.reconstruction.steps.s3_contacts.contact_law import Loading, first_touches
from palpate.reconstruction.steps.s3_contacts.contacts import ContactOptions

_LEAST_NOISE = 1e-3
"""Of the greatest force: noise below this is not believed."""
_ABOVE = 5.0
_MOST_SPOTS, _SPOT_M = 4000, 2.5e-4
"""Rows are told apart pair by pair, which memory limits; where they are more, those nearer to one another are
one spot before."""
_AROUND, _ASTRAY, _AGAINST = 6, np.cos(np.radians(60.0)), np.cos(np.radians(120.0))
"""A place whose force is so far from that of so many places around it, and weaker, or is against it, is
pressed along theirs (cosines)."""


def is_points(recording: Recording) -> bool:
    """Whether the rows are quasi-static points, whose clock only numbers them."""
    about = recording.description.get("recording", {})
    return bool(hasattr(about, "get") and about.get("quasi_static"))


@dataclass(frozen=True)
class _Group:
    rows: np.ndarray
    loading: Loading


def explore_points(recording: Recording, boundary: Boundary, options: ContactOptions) -> Measured:
    """The presses of a recording of points, in the order of its rows, over a known base.

    Raises ContactError where fewer places than options.least_palpations can be used.
    """
    force, position = recording.force_on_tool, recording.position
    groups, rejected = _groups(recording, options.site_m)
    few = len(rejected)
    if not groups:
        raise ContactError(
            f"none of the {few} places has two rows at different depth with a force that grows inwards: "
            "state the tip's centre of every row, and force_on"
        )
    noise = _noise(recording, [g.loading for g in groups])
    least = max(_ABOVE * noise, options.least_peak_n or 0.0)
    strong = []
    for group in groups:
        top = float(group.loading.push.max())
        if top > least:
            strong.append(group)
        else:
            rejected.append(_left_out(recording, group.rows, f"peaks at {top:.3f} N, below {least:.3g} N"))
    weak = len(groups) - len(strong)
    if len(strong) < options.least_palpations:
        raise ContactError(
            f"{len(strong)} places among {len(groups) + few} can be used ({few} have fewer than two rows or "
            f"a force that does not grow inwards, {weak} stay below {_ABOVE:g} times the noise of "
            f"{noise:.2g} N); at least {options.least_palpations} are needed"
        )
    try:
        shift, error = first_touches([g.loading for g in strong], noise)
    except ValueError as wrong:
        raise ContactError(
            f"{wrong}, so where the tip met the surface is unknown: probe some places at three depths or more"
        ) from wrong
    presses = _tabled(recording, strong, shift, error, noise, options)
    return Measured(
        recording=recording,
        position=position,
        force=force,
        noise_n=noise,
        boundary=boundary,
        presses=presses,
        rejected=tuple(sorted(rejected)),
        threshold_n=_ABOVE * noise,
        method="noise",
    )


def _left_out(recording: Recording, rows: np.ndarray, why: str) -> tuple[float, str]:
    """What is said of a place that is not used: its first row's t, and which it is and why."""
    x, y, z = 1e3 * recording.position[rows].mean(axis=0)
    number = f"row {rows[0] + 1}" if len(rows) == 1 else f"rows {rows[0] + 1} to {rows[-1] + 1}"
    return float(recording.t[rows[0]]), f"the place at ({x:.1f}, {y:.1f}, {z:.1f}) mm ({number}) {why}"


def _groups(recording: Recording, site_m: float) -> tuple[list[_Group], list[tuple[float, str]]]:
    """The rows of every visit to a place whose force grows inwards; what is said of the others."""
    force, position = recording.force_on_tool, recording.position
    size = np.linalg.norm(force, axis=1)
    strong = size >= np.quantile(size, 0.7)
    up = force[strong].sum(axis=0)
    up /= max(float(np.linalg.norm(up)), 1e-300)
    # rows of one place lie over one another; where the tip came in askew, the place is where it pressed most
    flat = position - (position @ up)[:, None] * up
    place = _places(flat, up, site_m)
    change = np.flatnonzero(np.diff(place)) + 1
    visits = np.split(np.arange(len(place)), change)
    if np.median([len(v) for v in visits]) < 2:
        # depth after depth over all places: each place is one press
        visits = [np.flatnonzero(place == s) for s in range(int(place.max()) + 1)]
    normals = _pressed_along(recording, visits)
    groups, rejected = [], []
    for rows, normal in zip(visits, normals, strict=True):
        origin = position[rows[0]]
        u = -(position[rows] - origin) @ normal
        push = force[rows] @ normal
        if len(rows) < 2 or np.ptp(u) <= 0:
            rejected.append(_left_out(recording, rows, "has fewer than two rows at different depth"))
        elif theilslopes(push, u)[0] <= 0:  # one row that is wrong turns no press
            why = f"has a force that does not grow inwards ({push[0]:.3f} to {push[-1]:.3f} N)"
            rejected.append(_left_out(recording, rows, why))
        else:
            groups.append(_Group(rows, Loading(u, push, origin, normal)))
    return groups, rejected


def _places(flat: np.ndarray, up: np.ndarray, site_m: float) -> np.ndarray:
    """(n,) the place of each row, by where it lies (n, 3) m across `up`."""
    spots, spot = flat, np.arange(len(flat))
    if len(flat) > _MOST_SPOTS:
        spot = np.unique(np.round(flat / _SPOT_M), axis=0, return_inverse=True)[1].reshape(-1)
        count = np.bincount(spot)
        spots = np.column_stack([np.bincount(spot, weights=x) / count for x in flat.T])
    if len(spots) > _MOST_SPOTS:
        raise ContactError(
            f"{len(flat)} rows without a time lie at {len(spots)} spots, more than {_MOST_SPOTS}: where they "
            "are in order of time, import them with --rate HZ"
        )
    return sites_of(spots, np.tile(up, (len(spots), 1)), site_m)[spot]


def _pressed_along(recording: Recording, visits: list[np.ndarray]) -> np.ndarray:
    """(v, 3) outward unit normal of each visit: of its own force, or, where that is far from the force of the
    visits around it, of theirs."""
    force, position = recording.force_on_tool, recording.position
    own = np.array([force[rows].sum(axis=0) / len(rows) for rows in visits])
    middle = np.array([position[rows].mean(axis=0) for rows in visits])
    _, near = cKDTree(middle).query(middle, k=min(_AROUND + 1, len(visits)))
    length = np.linalg.norm(own, axis=1)
    alone = own / np.maximum(length, 1e-300)[:, None]
    near = near.reshape(len(visits), -1)[:, 1:]
    if not near.size:
        return alone
    # each direction counts alike: one force that is wrong and great turns none
    around = alone[near].sum(axis=1)
    apart = np.einsum("vi,vi->v", alone, around) / np.maximum(np.linalg.norm(around, axis=1), 1e-300)
    weaker = np.median(length[near], axis=1) > length
    astray = (apart < _AGAINST) | ((apart < _ASTRAY) & weaker)
    chosen = np.where(astray[:, None], around, own)
    return chosen / np.maximum(np.linalg.norm(chosen, axis=1, keepdims=True), 1e-300)


def _noise(recording: Recording, loadings: list[Loading]) -> float:
    """N, of a force component: as stated, else what parabolas in depth leave of places with five rows."""
    top = max(float(each.push.max()) for each in loadings)
    if recording.force_noise_std_n:
        return recording.force_noise_std_n
    left = []
    for each in loadings:
        deep = each.push > 0.1 * each.push.max()
        if deep.sum() >= 5:
            fitted = np.polyfit(each.u[deep], each.push[deep], 2)
            rest = each.push[deep] - np.polyval(fitted, each.u[deep])
            left.append(rest * np.sqrt(deep.sum() / (deep.sum() - 3)))
    found = spread_about_zero(np.concatenate(left)) if left else 0.01 * top
    return max(found, _LEAST_NOISE * top)


def _tabled(
    recording: Recording,
    groups: list[_Group],
    shift: np.ndarray,
    error: np.ndarray,
    noise: float,
    options: ContactOptions,
) -> Presses:
    """The table: rows in the order of the places, numbered by the recording's clock."""
    order = np.concatenate([g.rows for g in groups])
    step = 1 / recording.sample_rate_hz
    counts = np.cumsum([0, *(len(g.rows) for g in groups)])
    t = recording.t[0] + step * np.arange(len(order))
    begin, end = t[counts[:-1]] - 0.5 * step, t[counts[1:] - 1] + 0.5 * step
    gathered = Recording(
        t=t,
        position=recording.position[order],
        force_on_tool=recording.force_on_tool[order],
        sample_rate_hz=recording.sample_rate_hz,
        tip_radius_m=recording.tip_radius_m,
        quaternion=None if recording.quaternion is None else recording.quaternion[order],
        force_noise_std_n=noise,
        description=recording.description,
    )
    peak = np.array([t[c + int(g.loading.push.argmax())] for c, g in zip(counts[:-1], groups, strict=True)])
    table = segment_recording(
        gathered,
        FoundPresses(
            onset_s=begin,
            peak_s=peak,
            centre=np.array(
                [g.loading.origin - at * g.loading.normal for g, at in zip(groups, shift, strict=True)]
            ),
            normal=np.array([g.loading.normal for g in groups]),
            onset_error_m=error,
            until_s=end,
            kinds=["points"] * len(groups),
        ),
        FoundAround(noise_n=noise),
        site_m=options.site_m,
    )
    return dataclasses.replace(table, recording=recording.content)
