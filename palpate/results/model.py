"""A model that prints and draws itself."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mechanics import model as room
from mechanics.model_files import write_model
from palpate.results.base import Result, dressed, quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter

    from palpate.report.view3d import View


@dataclass(frozen=True, eq=False, repr=False)
class Model(Result, room.Model):
    """An object that can be felt: mesh, material, support, tool, presses and effects; m, N, Pa, device frame.

    Every field is that of `mechanics.model.Model`: `material.young_modulus_pa`, `support.normal`,
    `tool.tip_radius_m`, mesh, effects. `plot`: the object with the places touched. `show`: the
    same in 3D on its support, the touches coloured by their own modulus, kPa.
    """

    def save(self, path: Path | str) -> Model:
        """Write a MODEL folder that ParaView opens, and return the model that knows it.

        What is computed for the model later, its compliance, is kept there. Raises ModelError where the
        folder exists and holds something else.
        """
        return model_of(self.replaced(path=write_model(path, self)))

    @property
    def name(self) -> str:
        """Of the recording, phantom or folder that it came from."""
        known = self.provenance.get("recording") or self.provenance.get("phantom")
        return str(known or (self.path.name if self.path else "model"))

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        mesh, nu = self.mesh, self.material.poisson_ratio
        height = float(self.support.height(mesh.points).max())
        return [
            f"Model of {self.name}: {modulus_words(self)}, Poisson's ratio {nu:g}",
            f"  {quantity(height, 'mm', 1e3, 3)} high; "
            f"tip radius {quantity(self.tool.tip_radius_m, 'mm', 1e3)}; {len(self.presses)} presses; "
            f"effects: {', '.join(self.effects) or 'none'}",
            f"  mesh: {len(mesh.points)} nodes, {len(mesh.tetrahedra)} tetrahedra of order {mesh.order}, "
            f"edges of {quantity(self.mesh_size_m, 'mm', 1e3)}",
            f"  folder: {self.path or 'not written; .save(MODEL) writes it'}",
        ]

    def _draw(self, ax: Axes) -> None:
        from palpate.report.object3d import draw_object

        draw_object(ax, self, touches=self.presses.point, show_base=True)
        ax.set_title(f"{self.name}: {modulus_words(self)}", fontsize=10)
        ax.legend(loc="upper center", frameon=False, bbox_to_anchor=(0.5, 0.0), ncols=2)

    def view(self) -> View:
        """The object to be turned, coloured by what is known of it."""
        from palpate.report.view3d import View, thing_of, usual_colourings

        return View(thing_of(self), self.presses.point, usual_colourings(self))

    def _place(self, plotter: Plotter) -> None:
        from palpate.report.quantities import KELVIN_VOIGT, MODULUS
        from palpate.results.scenery import add_dots, add_object

        add_object(plotter, self)
        for name, quantity_of in (("e_pa", MODULUS), ("k_v", KELVIN_VOIGT)):
            values = quantity_of.scale * self.presses.fits[name]
            known = np.isfinite(values)
            if known.any():
                add_dots(
                    plotter,
                    self.presses.point[known],
                    values[known],
                    label=quantity_of.label,
                    limits=quantity_of.limits(float(values[known].min()), float(values[known].max())),
                    colour_map=quantity_of.colour_map,
                )
                break


def modulus_words(model: room.Model) -> str:
    """The Young's modulus with its 95 % interval, kPa."""
    low, high = np.array(model.material.young_modulus_ci95_pa) / 1e3
    interval = f" (95 % interval {low:.1f} to {high:.1f})" if np.isfinite([low, high]).all() else ""
    return f"Young's modulus {model.material.young_modulus_pa / 1e3:.2f} kPa{interval}"


def model_of(plain: room.Model) -> Model:
    """The room's model as the door gives it."""
    return dressed(Model, plain)
