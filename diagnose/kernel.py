"""The press integrator: from a tip path to the force on the tool, at one site, with the contact effects in it.

Local frame of a site: axis 0 is the outward normal, axes 1 and 2 are tangents. `y` is how far the tip's centre
has gone INTO the object since first touch (y[0] is the depth), `f` the force on the tool, so that pressing gives
y[0] > 0 and f[0] > 0 and a dragged tip is pulled back against y. Solved at each sample:

    y = dent(f) + (far / E + I / k_tool) f

dent, normal: a law of mechanics.dent; dent, tangential: Mindlin's stick stiffness 8 G a / (2 - nu), held
incrementally, cut back as the contact shrinks, capped by mu F where there is slip.
"""

from __future__ import annotations

import numba
import numpy as np

from mechanics.dent import dent_force


@numba.njit(cache=True)
def integrate(start, y, site, far, radius, e_dent, e_far, nu, table, tool_give, mu, out, contact):
    """Force on the tool along every press.

    start: (p + 1,) first sample of each press. y: (n, 3) m. site: (p,) row of far (s, 3, 3), unit modulus, 1/m.
    radius: (p,) m, of tip and surface together. e_dent, e_far: (p,) Pa, modulus under the tip and of the whole.
    table: of a dent law. tool_give: 1 / k of a spring in series, m/N. mu: friction; negative: the tip sticks.
    Writes out: (n, 3) N and contact: (n,) m, the contact's radius.
    """
    for p in range(start.shape[0] - 1):
        c = far[site[p]] / e_far[p]
        c00 = c[0, 0] + tool_give
        c11 = c[1, 1] + tool_give
        c22 = c[2, 2] + tool_give
        c01, c02, c12 = c[0, 1], c[0, 2], c[1, 2]
        plane_strain = e_dent[p] / (1.0 - nu * nu)
        stick = 4.0 * e_dent[p] / ((1.0 + nu) * (2.0 - nu))
        dent = f1 = f2 = q1 = q2 = a_old = origin1 = origin2 = 0.0
        for i in range(start[p], start[p + 1]):
            depth = y[i, 0]
            if depth <= 0.0:
                dent = f1 = f2 = q1 = q2 = a_old = 0.0
                origin1 = y[i, 1]
                origin2 = y[i, 2]
                out[i, 0] = out[i, 1] = out[i, 2] = contact[i] = 0.0
                continue
            if dent <= 0.0:
                dent = 0.5 * depth
            y1 = y[i, 1] - origin1
            y2 = y[i, 2] - origin2
            low = 0.0
            high = np.inf
            t1 = t2 = a = f0 = 0.0
            for _ in range(40):
                f0, stiffness, a = dent_force(table, dent, radius[p], plane_strain)
                shrink = a / a_old if a < a_old else 1.0
                k = stick * (a if a < a_old else 0.5 * (a + a_old))
                # (I + k C_tt) t = shrink * t_before + k (y_t - C_tn f0 - q_before)
                b1 = shrink * f1 + k * (y1 - c01 * f0 - q1)
                b2 = shrink * f2 + k * (y2 - c02 * f0 - q2)
                m11 = 1.0 + k * c11
                m22 = 1.0 + k * c22
                m12 = k * c12
                det = m11 * m22 - m12 * m12
                t1 = (m22 * b1 - m12 * b2) / det
                t2 = (m11 * b2 - m12 * b1) / det
                if mu >= 0.0:
                    size = np.sqrt(t1 * t1 + t2 * t2)
                    if size > mu * f0:
                        t1 *= mu * f0 / size
                        t2 *= mu * f0 / size
                excess = dent + c00 * f0 + c01 * t1 + c02 * t2 - depth
                if excess > 0.0:
                    high = dent
                else:
                    low = dent
                step = -excess / (1.0 + c00 * stiffness)
                if abs(step) < 1e-9 * radius[p]:
                    break
                dent += step
                if not (low < dent < high):
                    dent = 0.5 * (low + high) if high < np.inf else 2.0 * low + 1e-10
            q1 = y1 - c01 * f0 - c11 * t1 - c12 * t2
            q2 = y2 - c02 * f0 - c12 * t1 - c22 * t2
            f1 = t1
            f2 = t2
            a_old = a
            out[i, 0] = f0
            out[i, 1] = t1
            out[i, 2] = t2
            contact[i] = a


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
    """Play operator (backlash) on a vector path: the tip is dragged once the handle is width / 2 away."""
    half = 0.5 * width
    for p in range(start.shape[0] - 1):
        for i in range(start[p], start[p + 1]):
            if i == start[p]:
                for k in range(3):
                    out[i, k] = y[i, k]
                continue
            d0 = y[i, 0] - out[i - 1, 0]
            d1 = y[i, 1] - out[i - 1, 1]
            d2 = y[i, 2] - out[i - 1, 2]
            distance = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
            s = 1.0 - half / distance if distance > half else 0.0
            out[i, 0] = out[i - 1, 0] + s * d0
            out[i, 1] = out[i - 1, 1] + s * d1
            out[i, 2] = out[i - 1, 2] + s * d2
