"""How deep the linear model may be pressed: where finite strain in the dent changes the force by a given
share.

Both laws push through the same far field; the dent is linear elastic in one and neo-Hookean (the axisymmetric
finite-strain solution of mechanics.contact.dent) in the other. The far field stays linear in both: its
strains are of the order of force / (E * size^2), far below those under the tip. The modulus cancels.
"""

from __future__ import annotations

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at

DEEPEST_IN_RADII = 2.5
_STEPS = 250


def linear_range(sites: TouchSites, tip_radius_m: float, share: float = 0.1) -> dict[str, float]:
    """For model.toml: `share`, and the least, median and greatest depth, m, among the sites beyond which the
    linear law's normal force is more than that off; the deepest that is tried where it is not."""
    depths = np.linspace(0.0, DEEPEST_IN_RADII * tip_radius_m, _STEPS + 1)
    path = (-depths[None, :, None] * sites.normals[:, None, :]).reshape(-1, 3)
    starts = np.arange(len(sites) + 1) * len(depths)
    normal = {}
    for law in ("linear", "neo-hookean"):
        force = forces_at(
            sites,
            path,
            starts,
            young_modulus_pa=1.0,
            tip_radius_m=tip_radius_m,
            law=law,
        ).reshape(len(sites), len(depths), 3)
        normal[law] = np.einsum("kni,ki->kn", force, sites.normals)
    error = np.zeros_like(normal["linear"])
    error[:, 1:] = normal["linear"][:, 1:] / normal["neo-hookean"][:, 1:] - 1
    beyond = np.abs(error) > share
    depth = np.where(beyond.any(axis=1), depths[beyond.argmax(axis=1)], depths[-1])
    return {
        "force_error": share,
        "depth_least_m": float(depth.min()),
        "depth_median_m": float(np.median(depth)),
        "depth_greatest_m": float(depth.max()),
        "sites": len(depth),
    }
