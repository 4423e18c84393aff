"""A press that prints and draws itself: force over depth at one place."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.results.base import Result, triple
from render import press as room
from render.base import Renderer

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from pyvista import Plotter


@dataclass(frozen=True, eq=False, repr=False)
class Curve(Result, room.Curve):
    """A force response: t (n,) s, position (n, 3) m of the tip's centre, depth (n,) m since first touch,
    force (n, 3) N on the tool, normal (3,) outward there; device frame.

    `plot`: force along the normal, and its length, over depth. `show`: the object as it is deformed at the
    deepest, with tip and force. renderer, tip_radius_m: what it was pressed with.
    """

    renderer: Renderer = field(kw_only=True)
    tip_radius_m: float = field(kw_only=True)

    @property
    def deepest(self) -> int:
        """Sample of the greatest depth."""
        return int(np.argmax(self.depth))

    def save(self, path: Path | str) -> Path:
        """Write `t,x,y,z,depth,fx,fy,fz` (s, m, m, N), which `palpate press --expect` takes."""
        room.write_curve(path, self)
        return Path(path)

    def lines(self) -> list[str]:
        """What `print` says, line by line, with units."""
        depth = float(self.depth.max())
        return [
            f"{self.renderer.name}: {self.peak_force_n:.4g} N at most; at {depth * 1e3:.3g} mm the force "
            f"on the tool is {', '.join(f'{f:.4g}' for f in self.force_at(depth))} N",
            f"  normal there {triple(self.normal, digits=3)}; {len(self.t)} samples in {self.t[-1]:.3g} s",
        ]

    def as_json(self) -> dict[str, Any]:
        """The figures of `palpate press --json`, keys with units."""
        depth = float(self.depth.max())
        return {
            "renderer": self.renderer.name,
            "normal": self.normal,
            "depth_m": depth,
            "force_at_depth_n": self.force_at(depth),
            "peak_force_n": self.peak_force_n,
        }

    def _draw(self, ax: Axes) -> None:
        touching = self.depth > 0
        depth = self.depth[touching] * 1e3
        ax.plot(depth, self.force[touching] @ self.normal, color="#1d3557", label="along the normal")
        size = np.linalg.norm(self.force[touching], axis=1)
        ax.plot(depth, size, "--", lw=1, color="#e08e1b", label="magnitude")
        ax.set(xlabel="depth [mm]", ylabel="force on the tool [N]", title=self.renderer.name)
        ax.set_xlim(left=0)
        ax.set_ylim(bottom=0)
        ax.legend(frameon=False, loc="upper left")

    def _place(self, plotter: Plotter) -> None:
        from palpate.results.scenery import add_deformed, add_force, add_path, add_tip

        last = self.deepest + 1
        state = self.renderer.start([self.tip_radius_m])
        steps = np.diff(self.t[:last], prepend=self.t[0] - (self.t[1] - self.t[0]))
        self.renderer.follow(state, np.ascontiguousarray(self.position[:last, None]), steps)
        add_deformed(plotter, self.renderer, self.renderer.displacement(state))
        add_path(plotter, self.position[:last])
        centre, force = self.position[self.deepest], self.force[self.deepest]
        add_tip(plotter, centre, self.tip_radius_m)
        add_force(plotter, centre + self.tip_radius_m * np.asarray(self.normal), force)
