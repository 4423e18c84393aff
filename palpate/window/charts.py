"""The live plots under the picture: force and depth of the last seconds."""

from __future__ import annotations

import numpy as np
import pyvista
import vtk

from palpate.window.trace import Trace

FORCE_COLOURS = ("#1b4f9c", "#d98c00")
DEPTH_COLOUR = "#2e7d32"


class LiveCharts:
    """Two charts on the plotter's active subplot; the second renderer's force is dashed over the first's.

    left: the share of the subplot's width that stays free.
    """

    def __init__(
        self, plotter: pyvista.Plotter, seconds: float, names: tuple[str, ...], *, left: float = 0.0
    ) -> None:
        width = 0.5 * (1.0 - left)
        self._force = self._chart(plotter, left, width, "force (N)", seconds)
        self._depth = self._chart(plotter, left + width, width, "depth (mm)", seconds)
        nothing = np.zeros(2), np.zeros(2)
        self._lines = [
            self._force.line(*nothing, color=colour, width=2.0, style=style, label=name)
            for name, colour, style in zip(names, FORCE_COLOURS, ("-", "--"), strict=False)
        ]
        self._deep = self._depth.line(*nothing, color=DEPTH_COLOUR, width=2.0)
        self._force.legend_visible = len(names) > 1
        # the newest values are on the right
        self._force.GetLegend().SetHorizontalAlignment(vtk.vtkChartLegend.LEFT)

    @staticmethod
    def _chart(
        plotter: pyvista.Plotter, left: float, width: float, label: str, seconds: float
    ) -> pyvista.Chart2D:
        chart = pyvista.Chart2D(size=(width, 1.0), loc=(left, 0.0), x_label="time (s)", y_label=label)
        chart.x_range = [-seconds, 0.0]
        chart.background_color = "white"
        for axis in (chart.x_axis, chart.y_axis):
            axis.label_size = 12
            axis.tick_label_size = 10
        plotter.add_chart(chart)
        return chart

    def update(self, trace: Trace) -> None:
        """Redraw from the trace; the range grows with the greatest value shown."""
        curves = trace.curves()
        if len(curves) < 2:
            return
        time_s = curves[:, 0]
        for line, column in zip(self._lines, (1, 3), strict=False):
            line.update(time_s, curves[:, column])
        self._deep.update(time_s, 1000.0 * curves[:, 2])
        columns = (1, 3) if len(self._lines) > 1 else (1,)
        self._force.y_range = [0.0, max(0.5, 1.15 * curves[:, columns].max())]
        self._depth.y_range = [0.0, max(2.0, 1.15 * 1000.0 * curves[:, 2].max())]
