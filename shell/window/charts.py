"""The live plots under the picture: force and depth of the last seconds."""

from __future__ import annotations

import numpy as np
import pyvista

from palpate.window.last_seconds import Trace
from palpate.window.lettering import set_type
from palpate.window.widgets import ACCENT, GREY, SECOND

LEAST_N, LEAST_MM = 0.5, 2.0
"""What the axes reach at least."""
DEPTH_COLOUR = "#2e7d32"


class LiveCharts:
    """Two charts on the plotter's active subplot; a second renderer's force is dashed over the first's."""

    def __init__(self, plotter: pyvista.Plotter, seconds: float) -> None:
        self._force = self._chart(plotter, 0.0, "force (N)", seconds, LEAST_N)
        self._depth = self._chart(plotter, 0.5, "depth (mm)", seconds, LEAST_MM)
        nothing = np.zeros(2), np.zeros(2)
        self._lines = [
            self._force.line(*nothing, color=colour, width=2.0, style=style)
            for colour, style in ((ACCENT, "-"), (SECOND, "--"))
        ]
        self._deep = self._depth.line(*nothing, color=DEPTH_COLOUR, width=2.0)
        self.tell(1)

    @staticmethod
    def _chart(
        plotter: pyvista.Plotter, left: float, label: str, seconds: float, least: float
    ) -> pyvista.Chart2D:
        chart = pyvista.Chart2D(size=(0.5, 1.0), loc=(left, 0.0), x_label="time (s)", y_label=label)
        chart.x_range, chart.y_range = [-seconds, 0.0], [0.0, least]
        chart.background_color = chart.border_color = "white"
        for axis in (chart.x_axis, chart.y_axis):
            set_type(axis.GetTitleProperties(), 12, False, GREY)
            set_type(axis.GetLabelProperties(), 11, False, GREY)
        plotter.add_chart(chart)
        return chart

    def tell(self, count: int) -> None:
        """How many forces are drawn, in the colours in which the panel says them."""
        self._told = count
        for line in self._lines[count:]:
            line.visible = False

    def update(self, trace: Trace) -> None:
        """Redraw from the trace; the range grows with the greatest value shown."""
        curves = trace.curves()
        if len(curves) < 2:
            return
        time_s = curves[:, 0]
        for line, column in zip(self._lines[: self._told], (1, 3), strict=False):
            line.update(time_s, curves[:, column])
        self._deep.update(time_s, 1000.0 * curves[:, 2])
        self._force.y_range = [0.0, max(LEAST_N, 1.15 * curves[:, (1, 3)].max())]
        self._depth.y_range = [0.0, max(LEAST_MM, 1.15 * 1000.0 * curves[:, 2].max())]
