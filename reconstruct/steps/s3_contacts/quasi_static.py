"""Quasi-static points: positions and forces without a time, some rows a place.

The rows of one place are a press of its own kind. They tell stiffness, law and place; of rates, delay and
memory they say nothing, and forces are taken as tared.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from mechanics.errors import ContactError
from mechanics.press_cutting import FoundAround, FoundPresses, cut
from mechanics.press_sites import sites_of
from mechanics.presses import Presses
from mechanics.recording import Recording
from mechanics.robust import spread_about_zero
from reconstruct.steps.s2_base.outline import Boundary
from reconstruct.steps.s3_contacts.contact_law import Loading, first_touches
from reconstruct.steps.s3_contacts.contacts import ContactOptions, Exploration

_LEAST_NOISE = 1e-3
"""Of the greatest force: noise below this is not believed."""
_ABOVE = 5.0
_MOST_ROWS = 4000


def is_points(recording: Recording) -> bool:
    """Whether the rows are quasi-static points, whose clock only numbers them."""
    about = recording.description.get("recording", {})
    return bool(hasattr(about, "get") and about.get("quasi_static"))


@dataclass(frozen=True)
class _Group:
    rows: np.ndarray
    loading: Loading


def explore_points(recording: Recording, boundary: Boundary, options: ContactOptions) -> Exploration:
    """The presses of a recording of points, in the order of its rows, over a known base.

    Raises ContactError where fewer places than options.least_palpations can be used.
    """
    if len(recording.t) > _MOST_ROWS:
        raise ContactError(
            f"{len(recording.t)} rows without a time are more than {_MOST_ROWS} points: where they are in "
            "order of time, import them with --rate HZ"
        )
    force, position = recording.force_on_tool, recording.position
    groups, few = _groups(recording, options.site_m)
    if not groups:
        raise ContactError(
            f"none of the {few} places has two rows at different depth with a force that grows inwards: "
            "state the tip's centre of every row, and force_on"
        )
    noise = _noise(recording, [g.loading for g in groups])
    strong = [g for g in groups if g.loading.push.max() > max(_ABOVE * noise, options.least_peak_n or 0.0)]
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
            "no place has four rows, so where the tip met the surface cannot be told: probe some places at "
            "four depths or more"
        ) from wrong
    presses = _tabled(recording, strong, shift, error, noise, options)
    return Exploration(
        recording=recording,
        position=position,
        force=force,
        noise_n=noise,
        boundary=boundary,
        presses=presses,
        rejected=(),
        threshold_n=_ABOVE * noise,
        method="noise",
    )


def _groups(recording: Recording, site_m: float) -> tuple[list[_Group], int]:
    """The rows of every visit to a place whose force grows inwards, and how many others there are."""
    force, position = recording.force_on_tool, recording.position
    size = np.linalg.norm(force, axis=1)
    strong = size >= np.quantile(size, 0.7)
    up = force[strong].sum(axis=0)
    up /= max(float(np.linalg.norm(up)), 1e-300)
    # rows of one place lie over one another; where the tip came in askew, the place is where it pressed most
    flat = position - (position @ up)[:, None] * up
    place = sites_of(flat, np.tile(up, (len(flat), 1)), site_m)
    change = np.flatnonzero(np.diff(place)) + 1
    visits = np.split(np.arange(len(place)), change)
    if np.median([len(v) for v in visits]) < 2:
        # depth after depth over all places: each place is one press
        visits = [np.flatnonzero(place == s) for s in range(int(place.max()) + 1)]
    groups = []
    for rows in visits:
        own = force[rows].sum(axis=0)
        length = float(np.linalg.norm(own))
        if len(rows) < 2 or not length > 0:
            continue
        normal = own / length
        origin = position[rows[0]]
        u = -(position[rows] - origin) @ normal
        push = force[rows] @ normal
        if np.ptp(u) <= 0 or np.polyfit(u, push, 1)[0] <= 0:
            continue
        groups.append(_Group(rows, Loading(u, push, origin, normal)))
    return groups, len(visits) - len(groups)


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
    table = cut(
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
