"""How deep the linear model may be pressed: where finite strain in the dent changes the force by a given
share.

Both laws push through the same far field; the dent is linear elastic in one and neo-Hookean (the axisymmetric
finite-strain solution of mechanics.contact.dent) in the other. The far field stays linear in both: its
strains are of the order of force / (E * size^2), far below those under the tip. The modulus cancels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from palpate.mechanics.compliance.sites import TouchSites
from palpate.mechanics.contact.touch import forces_at

DEEPEST_IN_RADII = 2.5
_STEPS = 250


@dataclass(frozen=True)
class LinearRange:
    """depth_m: (k,) indentation at each site where the linear force is off by `share`; inf where it is not by
    deepest_m."""

    share: float
    depth_m: np.ndarray
    deepest_m: float

    def table(self) -> dict[str, float]:
        """For model.toml: the share, and the least, median and greatest depth among the sites."""
        finite = np.where(np.isfinite(self.depth_m), self.depth_m, self.deepest_m)
        return {
            "force_error": self.share,
            "depth_least_m": float(finite.min()),
            "depth_median_m": float(np.median(finite)),
            "depth_greatest_m": float(finite.max()),
            "sites": len(finite),
        }


def linear_range(sites: TouchSites, tip_radius_m: float, share: float = 0.1) -> LinearRange:
    """The depth at every site beyond which the linear law's normal force is more than `share` off."""
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
    first = beyond.argmax(axis=1)
    depth = np.where(beyond.any(axis=1), depths[first], np.inf)
    return LinearRange(share, depth, float(depths[-1]))
