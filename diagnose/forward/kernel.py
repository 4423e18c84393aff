"""The press integrator: from a tip path to the force on the tool, at one place, with the contact effects in
it.

Local frame of a place: axis 0 is the outward normal, axes 1 and 2 are tangents. `y` is how far the tip's
centre has gone INTO the object since first touch (y[0] is the depth), `f` the force on the tool, so that
pressing gives f[0] > 0. The touch is mechanics.contact.touch, slip that of mechanics.effects.friction_slip,
and what follows the path mechanics.effects.laws_along_path: what is fitted is what is rendered.
"""

from __future__ import annotations

import numba
import numpy as np

from palpate.mechanics.contact.dent import dent_load
from palpate.mechanics.contact.touch import STATE_SIZE, touch_remember, touch_solve
from palpate.mechanics.effects.friction_slip import SLIPS, slip_excess, slip_length
from palpate.mechanics.effects.laws_along_path import sharp_laws, smooth_laws

SUB_PLACES = 5
"""Of a thinned step's path, over which a sharp law is averaged."""


@numba.njit(cache=True, error_model="numpy")
def integrate(start, y, far, radius, bend, e_dent, e_far, nu, table, tool_compliance, mu, out):
    """Force on the tool along every press.

    start: (p + 1,) first sample of each press. y: (n, 3) m. far: (p, 3, 3) unit modulus, 1/m.
    radius: (p,) m, of tip and surface together. bend: (p,) mechanics.contact.dent.bend_of. e_dent, e_far:
    (p,) Pa, modulus under the tip and of the whole. table: of a dent law. tool_compliance: 1 / k of a spring
    in series, m/N. mu: friction; inf: the tip sticks. Writes out: (n, 3) N.
    """
    state = np.zeros(STATE_SIZE)
    compliance = np.empty((3, 3))
    d = np.empty(3)
    for p in range(start.shape[0] - 1):
        for i in range(3):
            for j in range(3):
                own = tool_compliance if i == j else 0.0
                compliance[i, j] = far[p, i, j] / e_far[p] + own
        plane_strain = e_dent[p] / (1.0 - nu * nu)
        stick = 4.0 * e_dent[p] / ((1.0 + nu) * (2.0 - nu))
        touch_remember(state, 0.0, 0.0, 0.0, 0.0, radius[p])
        anchor1 = y[start[p], 1]
        anchor2 = y[start[p], 2]
        for i in range(start[p], start[p + 1]):
            if y[i, 0] <= 0.0 and state[1] == 0.0:
                anchor1 = y[i, 1]
                anchor2 = y[i, 2]
                out[i, 0] = out[i, 1] = out[i, 2] = 0.0
                continue
            fu = fv = fn = dent = a = du = dv = 0.0
            length = before = 0.0
            for slip in range(SLIPS):
                d[0] = -y[i, 0]
                d[1] = anchor1 - y[i, 1]
                d[2] = anchor2 - y[i, 2]
                fn, fu, fv, dent, a, du, dv, _, held = touch_solve(
                    state, d, compliance, table, radius[p], bend[p], plane_strain, stick
                )
                if dent > 0.0:
                    state[1] = dent  # where the next solution starts from
                pull = np.sqrt(fu * fu + fv * fv)
                excess, kept = slip_excess(pull, fn, mu)
                if excess == 0.0 or slip == SLIPS - 1:
                    fu *= kept
                    fv *= kept
                    break
                both = 1.0 / held + 0.5 * (compliance[1, 1] + compliance[2, 2])
                length = slip_length(slip, excess, before, length, both, 1.0)
                before = excess
                anchor1 += length * fu / pull
                anchor2 += length * fv / pull
            touch_remember(state, dent, a, du, dv, radius[p])
            if dent == 0.0:
                anchor1 = y[i, 1]
                anchor2 = y[i, 2]
            out[i, 0] = fn
            out[i, 1] = fu
            out[i, 2] = fv


@numba.njit(cache=True, error_model="numpy")
def follow(start, t, depth, site, felt, numbers, reach_m, sub_places, memory, f):
    """Let the laws along the path act on the quasi-static force f (n, 3) N of every press, in place.

    depth: (n,) m. site: (p,) and felt: (s,) greatest load of each site, changed. numbers, reach_m: of
    `laws_along_path`; memory: (laws, m). sub_places: of a sample's path over which sharp laws are
    averaged, 1 where samples are no means.
    """
    normal = np.array([1.0, 0.0, 0.0])
    force, mean = np.empty(3), np.empty(3)
    for p in range(start.shape[0] - 1):
        a, b = start[p], start[p + 1]
        memory[:] = 0.0
        deepest = 0.0
        for i in range(a, b):
            load = dent_load(depth[i])
            felt[site[p]] = max(felt[site[p]], load)
            deepest = max(deepest, depth[i])
            dt = t[i] - t[i - 1] if i > a else 0.0
            most = felt[site[p]]
            smooth_laws(numbers, memory, depth[i], deepest, load, most, dt, normal, f[i])
            mean[:] = 0.0
            before = 0.5 * (depth[i] + depth[max(i - 1, a)])
            after = 0.5 * (depth[i] + depth[min(i + 1, b - 1)])
            for k in range(sub_places):
                # along the way from half a step before to half a step after
                share = (k + 0.5) / sub_places
                x = depth[i]
                if share < 0.5:
                    x = before + 2.0 * share * (depth[i] - before)
                elif share > 0.5:
                    x = depth[i] + (2.0 * share - 1.0) * (after - depth[i])
                for c in range(3):  # a slice set to an array compiles for as long as all the rest
                    force[c] = f[i, c]
                sharp_laws(numbers, memory, x, deepest, dent_load(x), most, dt, normal, force)
                for c in range(3):
                    mean[c] += force[c] / sub_places
            for c in range(3):
                f[i, c] = mean[c]
            if depth[i] <= -reach_m:
                memory[:] = 0.0
                deepest = 0.0
