"""Displacement-force profiles of the presses, their 1D fits, and the rows of `palpations.csv`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mechanics.palpation import Palpation
from reconstruct.contacts import Exploration
from reconstruct.one_d import OneD, Press, press_of


def profiles(exploration: Exploration, normals: np.ndarray) -> list[Press]:
    """Depth along -n since first touch and force on the object along -n of every press, low-passed.

    normals: (k, 3) outward unit normals, one a contact.
    """
    presses = []
    for contact, n in zip(exploration.contacts, normals, strict=True):
        rows = slice(contact.start, contact.end)
        depth = -(exploration.position[rows] - contact.centre) @ n
        push = exploration.force[rows] @ n
        presses.append(
            press_of(exploration.recording.t[rows], depth, push, least_force_n=exploration.noise_n)
        )
    return presses


def palpation_rows(
    exploration: Exploration,
    points: np.ndarray,
    normals: np.ndarray,
    one_d: Sequence[OneD],
    moduli: np.ndarray,
) -> tuple[Palpation, ...]:
    """Rows of palpations.csv; points and normals (k, 3) are those of the reconstructed surface."""
    rows = []
    for contact, p, n, fit, e in zip(exploration.contacts, points, normals, one_d, moduli, strict=True):
        depth = -(exploration.position[contact.start : contact.end] - contact.centre) @ n
        rows.append(
            Palpation(
                t_onset=contact.t_onset,
                t_peak=contact.t_peak,
                x=float(p[0]),
                y=float(p[1]),
                z=float(p[2]),
                nx=float(n[0]),
                ny=float(n[1]),
                nz=float(n[2]),
                depth=float(depth.max()),
                k_kv=fit.k_kv,
                b_kv=fit.b_kv,
                k_hc=fit.k_hc,
                b_hc=fit.b_hc,
                r_hc=fit.r_hc,
                k_v=fit.k_v,
                k_c=fit.k_c,
                r_c=fit.r_c,
                k_h=fit.k_h,
                e_pa=float(e),
            )
        )
    return tuple(rows)
