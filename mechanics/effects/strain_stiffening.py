"""Strain stiffening: Yeoh's second coefficient makes the dent's force grow faster than neo-Hookean.

Fitted to the axisymmetric finite-strain solution of mechanics.dent at c20 / c10 = 0.35 (nu = 0.49, a
sticking sphere, to 1.8 radii; within 0.3 % of the force): normal 1 + 0.197 c20/c10 x^1.25, sideways 1 +
0.129 c20/c10 x^1.7, x = delta / R. 'palpate bench dent-table --stiffening' recomputes it. The far field is
left as it is.
"""

from __future__ import annotations

from mechanics.dent import DentLaw, grid

FORCE_PER_C20, FORCE_POWER = 0.197, 1.25
SIDEWAYS_PER_C20, SIDEWAYS_POWER = 0.129, 1.7


def stiffened(law: DentLaw, c20_over_c10: float) -> DentLaw:
    """The dent law of a material with Yeoh's c20 / c10, from that of the neo-Hookean one."""
    x = grid()
    return law.scaled(
        1 + FORCE_PER_C20 * c20_over_c10 * x**FORCE_POWER,
        1 + SIDEWAYS_PER_C20 * c20_over_c10 * x**SIDEWAYS_POWER,
        name=f"{law.name}, stiffening",
    )
