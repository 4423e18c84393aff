"""Pictures of a simulated recording show what was read beside what the ideal object would answer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from palpate.cli import main
from palpate.scenes.laboratory.simulate import SimulateOptions, simulate
from palpate.scenes.phantoms import phantom
from palpate.show.simulation import PRESSES_SHOWN, simulation_figure, view


def _figure(effects: dict[str, float]):
    options = SimulateOptions(protocol="brief", frame=True, position_resolution_m=0.0)
    result = simulate(phantom("cylinder"), effects, options, seed=3, sizes=False, ideal=True)
    return result, simulation_figure(result)


def _pairs(axes) -> list[tuple[np.ndarray, np.ndarray]]:
    """(read, ideal) curves (k, 2) of each press drawn."""
    curves = [np.column_stack(line.get_data()) for line in axes.lines]
    return list(zip(curves[::2], curves[1::2], strict=True))


def test_without_effect_every_press_lies_on_the_ideal_objects(springs) -> None:
    _, figure = _figure({})
    pairs = _pairs(figure.axes[3])
    assert len(pairs) == PRESSES_SHOWN
    for read, ideal in pairs:
        assert read == pytest.approx(ideal, abs=1e-5)


def test_soft_tool_shows_as_presses_that_read_deeper(springs) -> None:
    result, figure = _figure({"tool_compliance": 1})
    for read, ideal in _pairs(figure.axes[3]):
        deepest = int(ideal[:, 1].argmax())
        assert read[deepest, 0] - ideal[deepest, 0] == pytest.approx(1e3 * ideal[deepest, 1] / 1200, rel=0.02)
        assert read[:, 1] == pytest.approx(ideal[:, 1], abs=1e-5)


def test_press_that_differs_most_is_among_those_drawn(springs) -> None:
    result, _ = _figure({"force_bias": 1})
    odd = sorted((t.depth, k) for k, t in enumerate(result.touches) if t.kind == "press")[1][1]
    changed = np.where((result.motion.touch == odd)[:, None], 1.3 * result.clean_n, result.ideal_n)
    figure = simulation_figure(replace(result, clean_n=changed))
    ratios = [read[:, 1].max() / ideal[:, 1].max() for read, ideal in _pairs(figure.axes[3])]
    assert len(ratios) == PRESSES_SHOWN + 1 and max(ratios) > 1.2


def test_force_in_time_shows_the_change_of_the_force(springs) -> None:
    result, figure = _figure({"force_bias": 2})
    share = figure.axes[1].lines[1].get_ydata()
    assert share == pytest.approx(np.full(len(share), 0.1), rel=1e-3)


@pytest.mark.release
def test_command_draws_a_picture(springs, tmp_path: Path) -> None:
    picture = tmp_path / "c.png"
    arguments = ["simulate", "cylinder", "-o", str(tmp_path / "c.csv.gz"), "--protocol", "brief"]
    assert main([*arguments, "--effect", "time_delay=1", "--pictures", str(picture)]) == 0
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert picture.stat().st_size > 50_000


@pytest.mark.slow
def test_command_writes_a_page_whose_places_lie_on_the_phantom(springs, tmp_path: Path) -> None:
    page = tmp_path / "c.html"
    arguments = ["simulate", "cylinder", "-o", str(tmp_path / "c.csv.gz"), "--protocol", "brief", "--frame"]
    assert main([*arguments, "--effect", "tool_compliance=1", "--report", str(page)]) == 0
    text = page.read_text(encoding="utf-8")
    assert 'class="view3d"' in text and "palpate reconstruct" in text
    assert "with tool compliance of strength 1" in text
    result, _ = _figure({"tool_compliance": 1})
    seen = view(result)
    near = cKDTree(seen.thing.points).query(seen.places)[0]
    assert near.max() < 2e-3, "the places are in the frame of the surface"
    read, ideal, _ = seen.traces.lines
    assert np.abs(read.force_n - ideal.force_n).max() < 0.1, "noise alone: a soft tool moves the depth"
    deeper = read.depth_m - seen.traces.depth_m
    assert deeper[ideal.force_n[:, 0] > 0.4].min() > 0.2e-3 and deeper.max() < 5e-3
