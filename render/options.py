"""What a person may tune in a renderer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from palpate.mechanics.contact.dent import dent_laws
from palpate.mechanics.errors import OptionError
from palpate.mechanics.options import option

DOCUMENTED, BEST = SETTINGS = ("documented", "best")
"""Of another simulator: as its own documentation says, or as good as it gets."""


@dataclass(frozen=True)
class RenderOptions:
    """Tuning of the renderers; defaults render the ideal model plus the effects that the model names."""

    friction: float | None = option(
        None,
        "Coulomb friction coefficient; inf always sticks; default: the model's friction_slip, else 1",
        unit="1",
    )
    dent_law: str | None = option(
        None,
        "law of the local dent: neo-hookean renders finite strain; default: the model's own",
        choices=dent_laws(),
    )
    effects: bool = option(True, "render the effects that the model names")
    snap_to_touches: bool = option(
        True, "let the contact surface pass through the touched points of the model's palpations"
    )
    surface_edge_m: float = option(2.5e-3, "edge of the contact surface's triangles", unit="m")
    interpolation: str = option(
        "rbf",
        "interpolation of the 1D parameters over the surface",
        choices=("rbf", "nearest"),
        flag="--interpolation",
    )

    simulator_settings: str = option(
        DOCUMENTED,
        "settings of another simulator: as its documentation says, or the most accurate",
        choices=SETTINGS,
    )
    simulator_set: str = option("", "settings of another simulator to change: KEY=VALUE, comma separated")

    def __post_init__(self) -> None:
        if self.friction is not None and (math.isnan(self.friction) or self.friction < 0):
            raise OptionError(f"friction is {self.friction}; it must be 0 or greater (inf sticks)")
        if not self.surface_edge_m > 0:
            raise OptionError(f"surface_edge_m is {self.surface_edge_m}; it must be greater than 0 m")
        if self.dent_law is not None and self.dent_law not in dent_laws():
            raise OptionError(f"dent_law is '{self.dent_law}'; allowed are {', '.join(dent_laws())}")
        if self.interpolation not in ("rbf", "nearest"):
            raise OptionError(f"interpolation is '{self.interpolation}'; allowed are rbf, nearest")
