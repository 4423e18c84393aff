"""The press integrator: from a tip path to the force on the tool, at one site, with the contact effects in
it.

Local frame of a site: axis 0 is the outward normal, axes 1 and 2 are tangents. `y` is how far the tip's
centre
has gone INTO the object since first touch (y[0] is the depth), `f` the force on the tool, so that pressing
gives
f[0] > 0. The touch itself is mechanics.touch, so that what is fitted is what is rendered; here slip is added,
as
the renderer does it: where the tangential force exceeds mu F the anchor walks until it does not.
"""

from __future__ import annotations

import numba
import numpy as np

from mechanics.touch import STATE_SIZE, touch_remember, touch_solve


@numba.njit(cache=True)
def integrate(start, y, far, radius, e_dent, e_far, nu, table, tool_give, mu, out):
    """Force on the tool along every press.

    start: (p + 1,) first sample of each press. y: (n, 3) m. far: (p, 3, 3) unit modulus, 1/m.
    radius: (p,) m, of tip and surface together. e_dent, e_far: (p,) Pa, modulus under the tip and of the
    whole.
    table: of a dent law. tool_give: 1 / k of a spring in series, m/N. mu: friction; negative: the tip sticks.
    Writes out: (n, 3) N.
    """
    order = np.array([1, 2, 0])
    state = np.zeros(STATE_SIZE)
    give = np.empty((3, 3))
    d = np.empty(3)
    for p in range(start.shape[0] - 1):
        for i in range(3):
            for j in range(3):
                give[i, j] = far[p, order[i], order[j]] / e_far[p] + (tool_give if i == j else 0.0)
        plane_strain = e_dent[p] / (1.0 - nu * nu)
        stick = 4.0 * e_dent[p] / ((1.0 + nu) * (2.0 - nu))
        touch_remember(state, 0.0, 0.0, 0.0, 0.0, radius[p])
        anchor1 = y[start[p], 1]
        anchor2 = y[start[p], 2]
        for i in range(start[p], start[p + 1]):
            if y[i, 0] <= 0.0:
                touch_remember(state, 0.0, 0.0, 0.0, 0.0, radius[p])
                anchor1 = y[i, 1]
                anchor2 = y[i, 2]
                out[i, 0] = out[i, 1] = out[i, 2] = 0.0
                continue
            fu = fv = fn = dent = a = du = dv = 0.0
            for _ in range(4):
                d[0] = anchor1 - y[i, 1]
                d[1] = anchor2 - y[i, 2]
                d[2] = -y[i, 0]
                fu, fv, fn, dent, a, du, dv, _k = touch_solve(
                    state, d, give, table, radius[p], plane_strain, stick
                )
                if mu < 0.0:
                    break
                size = np.sqrt(fu * fu + fv * fv)
                over = size - mu * fn
                if over <= 1e-5:
                    break
                walk = over / size * (1.0 / (stick * max(a, 1e-6)) + 0.5 * (give[0, 0] + give[1, 1]))
                anchor1 += walk * fu
                anchor2 += walk * fv
            touch_remember(state, dent, a, du, dv, radius[p])
            out[i, 0] = fn
            out[i, 1] = fu
            out[i, 2] = fv


@numba.njit(cache=True)
def relax(start, t, force, g, tau, out):
    """Prony memory: out = force + sum_k g_k int exp(-(t - s) / tau_k) dforce(s), exact for linear pieces."""
    for p in range(start.shape[0] - 1):
        for k in range(g.shape[0]):
            h0 = h1 = h2 = 0.0
            for i in range(start[p], start[p + 1]):
                if i > start[p]:
                    dt = t[i] - t[i - 1]
                    decay = np.exp(-dt / tau[k])
                    gain = tau[k] / dt * (1.0 - decay)
                    h0 = decay * h0 + gain * (force[i, 0] - force[i - 1, 0])
                    h1 = decay * h1 + gain * (force[i, 1] - force[i - 1, 1])
                    h2 = decay * h2 + gain * (force[i, 2] - force[i - 1, 2])
                out[i, 0] += g[k] * h0
                out[i, 1] += g[k] * h1
                out[i, 2] += g[k] * h2


@numba.njit(cache=True)
def play(start, y, width, out):
    """Play operator (backlash), axis by axis: what follows is dragged once it is width / 2 behind."""
    half = 0.5 * width
    for p in range(start.shape[0] - 1):
        for k in range(3):
            out[start[p], k] = y[start[p], k]
            for i in range(start[p] + 1, start[p + 1]):
                out[i, k] = min(max(out[i - 1, k], y[i, k] - half), y[i, k] + half)
