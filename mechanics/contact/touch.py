"""The force of a touch: a sphere that sticks to an elastic body, followed along the path of its centre.

The displacement d of the tip since first touch is shared by the local dent and the compliance of the whole
object,
    d = dent(F) + far F / E,
with the normal dent after a law of mechanics.contact.dent and a tangential stick: every ring of the contact
circle holds the place where it first touched (method of dimensionality reduction with sticking springs, Popov
& Hess 2015, equivalent to Mindlin's incremental 8 G a / (2 - nu)); it forgets it when it lets go. Rings that
stiffen as the dent deepens push the tip out by the slope of the energy that they hold, or stretching shallow
and letting go deep would make energy. Unilateral, no adhesion.

The local frame has the normal first (mechanics.frames): n outward, then the tangents u and v.

The kernels are plain numba on arrays: 1 kHz rendering, replay and fits run the same ones. `state` is a
float array of STATE_SIZE, zero before first touch; it holds the ring memory and the last dent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.dent import STIFFEST, DentLaw, bend_of, dent_force, dent_law, effective_radius
from palpate.mechanics.contact.depth_factors import DepthFactors
from palpate.mechanics.frames import local_frames
from palpate.mechanics.kernels import kernel

_RINGS = 128  # memory of the stick; rings thinner than R/64 are merged
_SLOW = 24  # turns after which the dent is sought by secants
STATE_SIZE = 4 + 4 * _RINGS
"""state[0]: rings held; [1]: dent along -n, m; [2:4]: tangential dent, m; then of each ring its radius and
the integrals, over the radius and up to it, of the origin and of its square."""


@kernel
def _origin_integral(state, a):
    """Integrals over the radius 0..a of the tangential origin of each ring, m^2, and of its square, m^3, for
    a within what is held; the ring's number before."""
    count = int(state[0])
    low, high = 0, count - 1
    while low < high:
        middle = (low + high) // 2
        if state[4 + 4 * middle] < a:
            low = middle + 1
        else:
            high = middle
    end = 4 + 4 * low
    a0, u0, v0, s0 = _up_to(state, low)
    width = state[end] - a0
    f = (a - a0) / width if width > 0.0 else 1.0
    u, v, square = state[end + 1], state[end + 2], state[end + 3]
    return low, u0 + f * (u - u0), v0 + f * (v - v0), s0 + f * (square - s0)


@kernel
def _up_to(state, count):
    """Of the first count rings: radius and integrals; zeros of none."""
    if count == 0:
        return 0.0, 0.0, 0.0, 0.0
    end = 4 * count
    return state[end], state[end + 1], state[end + 2], state[end + 3]


@kernel
def _held_stretch(state):
    """Integral of the stretch squared over the radius as it was remembered, m^3."""
    top, u, v, square = _up_to(state, int(state[0]))
    return max(top * (state[2] ** 2 + state[3] ** 2) - 2.0 * (state[2] * u + state[3] * v) + square, 0.0)


@kernel
def _tangential(state, a, stick, cuu, cuv, cvv, free_u, free_v):
    """(force u, v, dent u, v, integral of the stretch squared over the radius) for contact radius a: free =
    d_t - C_tn F_n, stick = k_t / a."""
    top, mu, mv, square = _up_to(state, int(state[0]))
    if a < top:
        _, mu, mv, square = _origin_integral(state, a)
    held, new = min(a, top), max(a - top, 0.0)
    # the new ring touches half way between the last dent and this one
    reach, ou, ov = held + 0.5 * new, mu + 0.5 * new * state[2], mv + 0.5 * new * state[3]
    k = stick * reach
    bu = free_u + stick * (cuu * ou + cuv * ov)
    bv = free_v + stick * (cuv * ou + cvv * ov)
    m00, m01, m11 = max(1.0 + k * cuu, 1.0 - STIFFEST), k * cuv, max(1.0 + k * cvv, 1.0 - STIFFEST)
    if m01 * m01 > STIFFEST * m00 * m11 and not (cuu >= 0.0 and cuv * cuv <= cuu * cvv):
        m01 = 0.0  # what gives way against a force could turn it unstable; a slender body's own never does
    det = m00 * m11 - m01 * m01
    du = (m11 * bu - m01 * bv) / det
    dv = (m00 * bv - m01 * bu) / det
    of_held = held * (du * du + dv * dv) - 2.0 * (du * mu + dv * mv) + square
    of_new = new * ((du - state[2]) ** 2 + (dv - state[3]) ** 2) / 3.0
    return k * du - stick * ou, k * dv - stick * ov, du, dv, max(of_held, 0.0) + of_new


@kernel
def touch_remember(state, dent, a, du, dv, radius):
    """Write what touch_solve found into the memory; a dent of 0 forgets everything (the tip has let go)."""
    if not dent > 0.0:
        state[0] = state[1] = state[2] = state[3] = 0.0
        return
    state[1] = dent
    thin = radius / 64.0
    count = int(state[0])
    top, u, v, square = _up_to(state, count)
    if a > top:
        u0, v0, new = state[2], state[3], a - top
        u += 0.5 * new * (du + u0)
        v += 0.5 * new * (dv + v0)
        square += new * (du * du + du * u0 + u0 * u0 + dv * dv + dv * v0 + v0 * v0) / 3.0
        before = _up_to(state, max(count - 1, 0))[0]
        if count == 0 or (top - before >= thin and count < _RINGS):
            count += 1
    elif count > 0:
        low, u, v, square = _origin_integral(state, a)
        count = low + 1
    else:
        return
    state[0] = count
    end = 4 * count
    state[end], state[end + 1], state[end + 2], state[end + 3] = a, u, v, square
    state[2], state[3] = du, dv


@kernel
def touch_solve(state, d, far, table, radius, bend, plane_strain_modulus, stick):
    """Force at displacement d without writing the memory: (f_n, f_u, f_v, dent, a, d_u, d_v, k_n, k_t).

    Arguments as for touch_step. f: N on the tool, local frame. dent: m. a: contact radius, m. d_u, d_v:
    tangential dent, m. k_n: slope of the normal force against pressing deeper, N/m. k_t: stiffness of the
    stick, N/m. `touch_remember` takes what it needs.
    """
    press = -d[0]
    # what is held may bend towards the tip, whose plane it then meets later
    if not (press > 0.0 or state[1] > 0.0):
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    cnn, cuu, cuv, cvv = far[0, 0], far[1, 1], far[1, 2], far[2, 2]
    # no dent is deeper than what a stiffening support (1 / (1 - STIFFEST)) makes of the whole displacement:
    # a tip that is dragged far while it sticks must not run away
    low, high = 0.0, (abs(press) + np.sqrt(d[1] * d[1] + d[2] * d[2])) / (1.0 - STIFFEST)
    dent = state[1] if 0.0 < state[1] < high else 0.5 * abs(press)
    tolerance = 1e-10 * radius
    # a compliance that is positive definite as it is needs no limit
    minor = cuu * cvv - cuv * cuv
    within = cvv * far[1, 0] ** 2 - 2.0 * cuv * far[1, 0] * far[2, 0] + cuu * far[2, 0] ** 2
    sound = cuu > 0.0 and minor > 0.0 and cnn * minor >= within
    fn = fu = fv = a = held = du = dv = stiffness = compliance = 0.0
    last_dent = last_excess = 0.0
    stretch = _held_stretch(state)  # a first turn without it would shut the dent out of where it was
    for turn in range(80):
        dented, stiffness, a, grip, stiffens = dent_force(table, dent, radius, bend, plane_strain_modulus)
        fn = dented + 0.5 * stick * stiffens * stretch
        # a support close below makes cnn negative; a contact wider than its patch must not turn unstable by
        # that
        compliance = max(cnn, -STIFFEST / stiffness)
        # near an edge the coupling may exceed what keeps the joint compliance positive definite
        cun, cvn = far[1, 0], far[2, 0]
        couple = cun * cun + cvn * cvn
        held = stick * grip * a
        least = (1.0 / stiffness + compliance) * (1.0 / held + max(min(cuu, cvv), -STIFFEST / held))
        if couple > STIFFEST * least and not sound:
            cun *= np.sqrt(STIFFEST * least / couple)
            cvn *= np.sqrt(STIFFEST * least / couple)
        # on the object the normal force is -fn n; its far-field compliance appears in the tangential balance
        free_u, free_v = d[1] + cun * fn, d[2] + cvn * fn
        fu, fv, du, dv, stretch = _tangential(state, a, stick * grip, cuu, cuv, cvv, free_u, free_v)
        fn = dented + 0.5 * stick * stiffens * stretch
        excess = dent + compliance * fn - cun * fu - cvn * fv - press
        if excess > 0.0:
            high = dent
        else:
            low = dent
        slope = 1.0 + compliance * stiffness
        if turn > _SLOW:  # a slender body's coupling takes up most of that slope
            secant = (excess - last_excess) / (dent - last_dent)
            if secant > 0.0:
                slope = secant
        last_dent, last_excess = dent, excess
        step = -excess / slope
        if abs(step) < tolerance:
            break
        if not (press > 0.0 or high > tolerance):
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        dent += step
        if not (low < dent < high):
            dent = 0.5 * (low + high)
    return fn, -fu, -fv, dent, a, du, dv, stiffness / (1.0 + compliance * stiffness), held


@kernel
def touch_step(state, d, far, table, radius, bend, plane_strain_modulus, stick):
    """Advance one touch to displacement d: (f_n, f_u, f_v) on the tool, N, local frame (n, u, v).

    state: (STATE_SIZE,), changed in place; all zero before first touch.
    d: (3,) m since first touch, local frame (n outward: d[0] < 0 presses in).
    far: (3, 3) m/N of the actual modulus, local frame, symmetric. table: of a dent law. radius: effective,
    m. bend: mean curvature times the tip's radius (mechanics.contact.dent.bend_of).
    plane_strain_modulus: E / (1 - nu^2), Pa. stick: 8 G / (2 - nu), Pa.
    """
    fn, fu, fv, dent, a, du, dv, _, _ = touch_solve(
        state, d, far, table, radius, bend, plane_strain_modulus, stick
    )
    touch_remember(state, dent, a, du, dv, radius)
    return fn, fu, fv


@njit(cache=True, error_model="numpy")
def touch_path(d, frame, far, table, radius, bend, plane_strain_modulus, stick, out):
    """Follow a path: d (n, 3) m and out (n, 3) N on the tool in the global frame; far (3, 3) m/N global."""
    local_far = frame @ far @ frame.T
    state = np.zeros(STATE_SIZE)
    local = np.empty(3)
    for i in range(d.shape[0]):
        for r in range(3):
            local[r] = frame[r, 0] * d[i, 0] + frame[r, 1] * d[i, 1] + frame[r, 2] * d[i, 2]
        fn, fu, fv = touch_step(state, local, local_far, table, radius, bend, plane_strain_modulus, stick)
        for c in range(3):
            out[i, c] = frame[1, c] * fu + frame[2, c] * fv + frame[0, c] * fn


@njit(cache=True, error_model="numpy")
def _touch_paths(d, starts, frames, fars, table, radii, bends, plane_strain_modulus, stick, out):
    for k in range(len(starts) - 1):
        part = slice(starts[k], starts[k + 1])
        touch_path(
            d[part], frames[k], fars[k], table, radii[k], bends[k], plane_strain_modulus, stick, out[part]
        )


def moduli(young_modulus_pa: float, poisson_ratio: float) -> tuple[float, float]:
    """(E*, 8 G / (2 - nu)), Pa: what the kernels want."""
    nu = poisson_ratio
    return young_modulus_pa / (1 - nu**2), 4 * young_modulus_pa / ((1 + nu) * (2 - nu))


@dataclass(frozen=True)
class TouchedPlaces:
    """Where k touches are. normals: (k, 3) outward unit. far: (k, 3, 3) 1/m, unit modulus (TouchSites.far).
    curvature: (k,) or one, 1/m, mean, convex positive. bracing, braced: (k,) or one, 1/m (TouchSites).
    factors: on the forces, where the places are solved."""

    normals: np.ndarray
    far: np.ndarray
    curvature: np.ndarray | float = 0.0
    bracing: np.ndarray | float = 0.0
    braced: np.ndarray | float = 0.0
    factors: DepthFactors | None = None

    def of(self, touches: Sequence[int]) -> TouchedPlaces:
        """Those of some touches."""
        rows = np.asarray(touches)
        bent = np.broadcast_arrays(self.curvature, self.bracing, self.braced, self.normals[:, 0])
        curvature, bracing, braced = (each[rows] for each in bent[:3])
        factors = None if self.factors is None else self.factors.of(rows)
        return TouchedPlaces(self.normals[rows], self.far[rows], curvature, bracing, braced, factors)


def touch_force(
    displacement: np.ndarray,
    normal: np.ndarray,
    far: np.ndarray,
    *,
    young_modulus_pa: float,
    poisson_ratio: float,
    tip_radius_m: float,
    curvature: float = 0.0,
    law: str | DentLaw = "sphere",
) -> np.ndarray:
    """Force on the tool (n, 3), N, along the path of one touch; device frame.

    displacement: (n, 3) m, the tip's centre less where it was at first touch, in order of time. normal:
    (3,) outward. far: (3, 3) 1/m, unit modulus (TouchSites.far). curvature: 1/m, mean, convex positive.
    """
    starts = np.array([0, len(displacement)])
    return touch_forces(
        displacement,
        starts,
        TouchedPlaces(np.asarray(normal)[None], np.asarray(far)[None], np.array([curvature])),
        young_modulus_pa=young_modulus_pa,
        poisson_ratio=poisson_ratio,
        tip_radius_m=tip_radius_m,
        law=law,
    )


def touch_forces(
    displacement: np.ndarray,
    starts: np.ndarray,
    places: TouchedPlaces,
    *,
    young_modulus_pa: float,
    poisson_ratio: float,
    tip_radius_m: float,
    law: str | DentLaw = "sphere",
) -> np.ndarray:
    """Force on the tool (n, 3), N, of k touches whose paths follow one another.

    displacement: (n, 3) m; touch i holds the rows starts[i] to starts[i + 1] (k + 1 entries) and begins
    untouched.
    """
    law = law if isinstance(law, DentLaw) else dent_law(law, poisson_ratio)
    displacement = np.ascontiguousarray(displacement, dtype=float)
    starts = np.ascontiguousarray(starts, dtype=np.int64)
    count = len(starts) - 1
    curvature = np.broadcast_to(np.asarray(places.curvature, dtype=float), (count,))
    bracing = places.bracing + law.braced * np.asarray(places.braced)
    radii, bends = effective_radius(tip_radius_m, curvature), bend_of(tip_radius_m, curvature, bracing)
    plane_strain, stick = moduli(young_modulus_pa, poisson_ratio)
    out = np.zeros_like(displacement)
    frames = local_frames(places.normals)
    fars = np.ascontiguousarray(np.asarray(places.far, dtype=float) / young_modulus_pa)
    _touch_paths(displacement, starts, frames, fars, law.table, radii, bends, plane_strain, stick, out)
    if places.factors is not None:
        touch = np.repeat(np.arange(count), np.diff(starts))
        out *= places.factors.at(touch, -np.einsum("nc,nc->n", displacement, places.normals[touch]))[:, None]
    return out


def touched(sites: TouchSites) -> TouchedPlaces:
    """One touch at each of the k sites."""
    bent = (sites.curvature, sites.bracing, sites.braced)
    return TouchedPlaces(sites.normals, sites.far, *bent, sites.factors)


def forces_at(
    sites: TouchSites,
    displacement: np.ndarray,
    starts: np.ndarray,
    *,
    young_modulus_pa: float,
    tip_radius_m: float,
    law: str | DentLaw,
) -> np.ndarray:
    """`touch_forces` of one touch at each of the k sites, by what they are."""
    return touch_forces(
        displacement,
        starts,
        touched(sites),
        young_modulus_pa=young_modulus_pa,
        poisson_ratio=sites.poisson_ratio,
        tip_radius_m=tip_radius_m,
        law=law,
    )
