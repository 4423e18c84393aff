"""How long a picture of the touch window takes: the work before it, and its drawing.

A mouse presses into the middle of the first picture while frames go by, off screen, as fast as they come.
`tick` is everything but the drawing (state in, surface and shadow moved, words, plots), which a graphics card
does not make faster: 1 over it is what a card could reach at most. The processor's own time stands beside the
clock's, for machines that do something else as well. Then each part is drawn alone: where pictures are slow,
the second one, words and plots come less often (palpate.window.worker).
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from benchmarks.evidence import Figure
from benchmarks.timing import table

WANTED_HZ = 30.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """What is touched, how often it is drawn, and how large."""
    parser.add_argument("--scene", default="demo", help="scene, MODEL or phantom (default: demo)")
    parser.add_argument("--frames", type=int, default=150, help="pictures, each in air and in a press")
    parser.add_argument("--size", type=int, nargs=2, default=[1280, 800], metavar=("W", "H"), help="pixels")
    parser.add_argument("--beside", action=argparse.BooleanOptionalAction, default=True,
                        help="a second picture beside the first, as scenes have it")  # fmt: skip


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Print the table; returns its figures, s."""
    from palpate.devices.channel import PoseChannel
    from palpate.devices.registry import DeviceChoice, options_of
    from palpate.scenes.build import model_of
    from palpate.scenes.scene import load_scene
    from palpate.window.session import SessionOptions, TouchSession
    from palpate.window.window import TouchWindow

    scene = load_scene(arguments.scene)
    model = model_of(scene)
    channel = PoseChannel.create()
    above = model.mesh.points.mean(axis=0) + 0.1 * model.support.normal
    channel.write(time.perf_counter(), tuple(above))
    mouse = DeviceChoice("mouse", {"channel": str(channel.path), "options": options_of("mouse")()})
    beside = (scene.beside or "hunt-crossley") if arguments.beside else ""
    options = SessionOptions(scene.renderer, beside)
    session = TouchSession(model, title=scene.title, device=mouse, options=options)
    found: dict[str, Any] = {}
    with session:
        session.start()
        session.enable()
        window = TouchWindow(session, scene, channel, off_screen=True, size=tuple(arguments.size))
        window.plotter.show(interactive_update=True, auto_close=False)
        renderer = window.picture_renderers[0]
        renderer.SetWorldPoint([*model.mesh.points.mean(axis=0).tolist(), 1.0])
        renderer.WorldToDisplay()
        window.controls.point(*(round(v) for v in renderer.GetDisplayPoint()[:2]))
        for name, down in (("in air", False), ("in a press", True)):
            window.controls.press(down)
            _frames(window, arguments.frames // 3)  # until the tip is there
            found[name] = _frames(window, arguments.frames)
        found["parts"] = _parts(window, arguments.frames)
        found["drawn by"] = _card(window)
        window.plotter.close()
    channel.close()
    rows = []
    for name in ("in air", "in a press"):
        tick, draw, cpu = found[name]["tick_s"], found[name]["draw_s"], found[name]["cpu_s"]
        rows.append([name, 1e3 * tick, 1e3 * draw, 1e3 * found[name]["p95_s"], 1e3 * cpu, 1 / (tick + draw),
                     1 / cpu, 1 / tick])  # fmt: skip
    size = "x".join(map(str, arguments.size))
    drawn = f"{window.sides} pictures, drawn by {found['drawn by']}"
    print(f"{scene.name}, {size}, {drawn}; wanted {WANTED_HZ:g} Hz")
    header = ["the tip is", "tick [ms]", "draw [ms]", "both, 95 % [ms]", "CPU [ms]", "pictures a second",
              "on a free core", "at most, drawn for nothing"]  # fmt: skip
    print(table(header, rows))
    print(table(["drawn alone", "CPU [ms]"], [[name, 1e3 * cpu] for name, cpu in found["parts"].items()]))
    figures = []
    for name in ("in air", "in a press"):
        cpu, (least, most) = found[name]["cpu_s"], found[name]["cpu_spread_s"]
        what = f"pictures a second {name}, drawn by {found['drawn by']}, {window.sides} pictures, {size}"
        by_clock = 1.0 / (found[name]["tick_s"] + found[name]["draw_s"])
        figures += [
            Figure(f"{what}, by processor time", 1 / cpu, (1 / most, 1 / least), "Hz").at_least(WANTED_HZ),
            Figure(f"{what}, by the clock", by_clock, unit="Hz"),
        ]
    return {**found, "figures": figures}


def _parts(window: Any, count: int) -> dict[str, float]:
    """Median processor time, s, of drawing each part of the window by itself, and all of them."""
    first, second, *others = window.plotter.renderers
    shown = [renderer for renderer in (first, second, *others) if renderer.GetDraw()]
    parts = {"what is felt": [first], "second picture": [second], "words and plots": others, "all": shown}
    found = {}
    for name, drawn in parts.items():
        for renderer in window.plotter.renderers:
            renderer.SetDraw(renderer in drawn and renderer in shown)
        found[name] = _frames(window, count, move=False)["cpu_s"]
    return found


def _frames(window: Any, count: int, *, move: bool = True) -> dict[str, Any]:
    """Medians over `count` pictures, s, by the clock; cpu_s: of this process, both together, and its
    quartiles. move: tick before each."""
    ticks, draws, cpu = [], [], []
    for _ in range(count):
        used, began = time.process_time(), time.perf_counter()
        if move:
            window.tick()
        between = time.perf_counter()
        window.plotter.render()
        ticks.append(between - began)
        draws.append(time.perf_counter() - between)
        cpu.append(time.process_time() - used)
    both = np.add(ticks, draws)
    return {"tick_s": float(np.median(ticks)), "draw_s": float(np.median(draws)),
            "p95_s": float(np.percentile(both, 95)), "cpu_s": float(np.median(cpu)),
            "cpu_spread_s": tuple(float(v) for v in np.percentile(cpu, [25, 75]))}  # fmt: skip


def _card(window: Any) -> str:
    lines = str(window.plotter.render_window.ReportCapabilities()).splitlines()
    return next((line.split(":", 1)[1].strip() for line in lines if "renderer string" in line), "unknown")
