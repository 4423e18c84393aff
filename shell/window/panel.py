"""What stands beside the pictures: force, what to do next, buttons; settings; help."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from palpate.render.registry import names
from palpate.show.colours import GREY, HINT, WARNING, colour_of
from palpate.window.guide import ON_IT
from palpate.window.keys import KEYS, help_rows, shown
from palpate.window.pointer import LEAST_PRESS_M, MOST_PRESS_M
from palpate.window.session import FRICTIONS, MODULUS_STEP, TouchSession
from palpate.window.widgets import BODY, Item, Row
from palpate.window.worker import Frame
from palpate.words import begun, mm, renderer_words, spaced

if TYPE_CHECKING:
    from palpate.window.window import TouchWindow

T = TypeVar("T")
DRAGGED_M = 0.006
DEPTH = "press depth"
"""The slider's name."""
HERE = "N/m here: how much more force the next metre would take; the map has force over depth"


class NextStep:
    """What a newcomer does next: each step is said until it was done, in this order."""

    def __init__(self, window: TouchWindow, *, mouse: bool) -> None:
        pointer, session, orbit = window.pointer, window.session, window.orbit
        depth, look = pointer.press_depth_m, orbit.stands
        self._began: np.ndarray | None = None
        self._can_stop = session.has_force
        free = window.game is None and not window.guided
        self._last = "Press anywhere. Settings changes what you feel." if free else ""

        def touching(frame: Frame) -> bool:
            return frame.touching

        steps: list[tuple[str, Callable[[Frame], bool]]] = [
            ("Move the mouse over the object.", lambda _: pointer.target is not None),
            ("Hold the left button: the tip presses in.", _pushed),
            ("Hold it, and turn the wheel: deeper, or less deep.", lambda _: pointer.press_depth_m != depth),
            ("Hold it, and drag: the tip sticks, then slides.", self._dragged),
            ("Hold the right button and move: the view turns.", lambda _: orbit.stands != look),
        ]
        if not free:
            del steps[2:4]
        if not mouse:
            steps = [("Move the device until the tip touches.", touching)]
        if free and not session.beside_name:
            both = "Side by side: feel one model, see another."
            steps.append((both, lambda _: bool(session.beside_name)))
        if free:
            ball = "Stiff ball puts one under the tip: press there again."
            steps.append((ball, lambda _: session.inclusion is not None))
        self._steps = steps

    def _dragged(self, frame: Frame) -> bool:
        self._began = None if not frame.touching else frame.tip_m if self._began is None else self._began
        return self._began is not None and float(np.linalg.norm(frame.tip_m - self._began)) > DRAGGED_M

    def line(self, frame: Frame) -> str:
        """For the panel."""
        self._steps = [(words, done) for words, done in self._steps if not done(frame)]
        if self._can_stop and not frame.force_enabled:
            return "The force is off: Space, or Force, switches it on."
        return self._steps[0][0] if self._steps else self._last


def main_rows(window: TouchWindow, frame: Frame) -> list[Row]:
    """The column on the left."""
    session = window.session
    felt, *others = frame.views
    inside = [f"{session.young_modulus_pa / 1000:.1f} kPa", friction_words(session.friction)]
    about = f"felt: {renderer_words(felt.name)}"
    if session.feels_inside:
        about = ", ".join([about, *inside])
    rows: list[Row] = [
        (Item(window.scene.title, size=16, bold=True),),
        (Item(about, size=12, colour=GREY, tip=_about_tip(felt.name, session)),),
        (Item(f"{np.linalg.norm(felt.force_n):.2f} N", size=46, bold=True, colour=colour_of(felt.name)),),
    ]
    # its row is there without it too: no button moves away from under the mouse
    second = "".join(f"{np.linalg.norm(v.force_n):.2f} N  {renderer_words(v.name)}" for v in others)
    called, colour = (others[0].name, colour_of(others[0].name)) if others else ("", GREY)
    rows.append((Item(second, size=15, bold=True, colour=colour, tip=called),))
    rows += [
        (Item(_where(window, frame), size=12, colour=GREY, tip=HERE),),
        (Item(window.next_words(frame), fill=HINT, least_lines=6 if window.game else 2),),
    ]
    if window.moved_by_mouse:
        rows += depth_rows(window)
    return [*rows, *_buttons(window), *_status(window, frame)]


def _where(window: TouchWindow, frame: Frame) -> str:
    if frame.touching:
        return f"{mm(frame.depth_m, '.1f')} deep, {frame.stiffness_n_per_m:.0f} N/m here"
    if not _pushed(frame):
        return "in air"
    # a force of the last moment is still drawn where the tip has just left the object
    low = window.session.model.support.height(frame.tip_m) < ON_IT * window.session.servo.tip_radius_m
    return "on the support" if low else "touching"


def _pushed(frame: Frame) -> bool:
    """Whether the tip is on something, the object or its support."""
    return any(np.linalg.norm(view.force_n) > 0.0 for view in frame.views)


def depth_rows(window: TouchWindow) -> list[Row]:
    """How deep a press goes at most."""
    pointer = window.pointer
    low, high = 1e3 * LEAST_PRESS_M, 1e3 * MOST_PRESS_M
    depth = 1e3 * pointer.press_depth_m

    def slide(share: float) -> None:
        pointer.go_deep(low + share * (high - low))

    return [
        (Item(f"A press goes {depth:.1f} mm deep", size=12),),
        (Item(DEPTH, share=(depth - low) / (high - low), slide=slide),),
    ]


def _buttons(window: TouchWindow) -> list[Row]:
    session, offered = window.session, window.controls.offered
    chosen = {
        "b": bool(session.beside_name),
        "c": window.stiffness_drawn,
        "i": session.inclusion is not None,
        "r": session.recording is not None,
        "s": window.aside == "s",
        "h": window.aside == "h",
        "m": window.more,
    }
    buttons = {
        name: Item(
            key.button,
            do=partial(window.controls.do, name),
            tip=f"{key.does} ({shown(name)})",
            on=chosen.get(name, False),
        )
        for name, key in KEYS.items()
        if key.button and name in offered and (window.more or not key.rare)
    }
    first = buttons.pop("Return", None)
    rows: list[Row] = [(first,)] if first else []
    for group in dict.fromkeys(KEYS[name].group for name in ("b", "c", "r")):
        of_group = [button for name, button in buttons.items() if KEYS[name].group == group]
        rows += [*_title(group), *_grid(of_group)] if of_group else []
    return rows


def _status(window: TouchWindow, frame: Frame) -> list[Row]:
    """What goes on besides."""
    session, worker = window.session, window.session.worker
    rows: list[Row] = []
    if worker.busy:
        rows.append((Item(begun(worker.busy), size=12),))
        if worker.share > 0.0:
            rows.append((Item("busy", share=worker.share),))
    elif worker.failure:
        rows.append((Item(worker.failure, size=12, colour=WARNING),))
    if session.recording is not None:
        said = f"Recording {frame.recorded_s or 0.0:.0f} s, {session.recording.words}"
        rows.append((Item(said, size=12, colour=WARNING),))
    table = begun(frame.table) if session.feels_inside else ""
    more = (window.known_words, table, frame.reason, window.notice)
    return [*rows, *((Item(word, size=12, colour=GREY),) for word in more if word)]


def _about_tip(name: str, session: TouchSession) -> str:
    """What the line says in the field's terms."""
    if not session.feels_inside:
        return name
    return (
        f"{name}; Young's modulus {session.young_modulus_pa / 1000:.1f} kPa; the tip slides where the force "
        "along the surface exceeds the friction coefficient times the force into it"
    )


def friction_words(friction: float) -> str:
    """Of a coefficient."""
    return "sticks" if math.isinf(friction) else f"friction {friction:g}"


def _title(text: str) -> list[Row]:
    """Over the rows that follow, a little apart from those before."""
    return [(Item("", size=4),), (Item(text, bold=True, colour=GREY, size=BODY - 1),)]


def _grid(items: Sequence[Item], columns: int = 2) -> list[Row]:
    """Items side by side; the last row is filled with nothing."""
    rows = [tuple(items[k : k + columns]) for k in range(0, len(items), columns)]
    if rows and len(rows[-1]) < columns:
        rows[-1] += tuple(Item("") for _ in range(columns - len(rows[-1])))
    return rows


def _choices(chosen: T, every: Sequence[tuple[str, T]], do: Callable[[T], object]) -> list[Item]:
    """A button each; the one that holds now is marked."""
    return [
        Item(words, do=partial(do, value), on=value == chosen, size=12, tip=_technical(words, value))
        for words, value in every
    ]


def _technical(words: str, value: object) -> str:
    """A renderer's name by which commands know it."""
    return value if isinstance(value, str) and value not in ("", words) else ""


def settings_rows(window: TouchWindow) -> list[Row]:
    """The column on the right: everything that may be changed about what is felt."""
    session = window.session

    renderers = [(renderer_words(name), name) for name in names()]
    rows = [
        *_title("What you feel"),
        *_grid(_choices(session.renderer_name, renderers, session.set_renderer), 1),
        *_title("Beside it"),
        *_grid(_choices(session.beside_name, [("nothing", ""), *renderers], session.set_beside), 1),
    ]
    if session.feels_inside:
        frictions = [("sticks" if math.isinf(mu) else f"{mu:g}", mu) for mu in FRICTIONS]
        sticks, *slips = _choices(session.friction, frictions, session.set_friction)
        modulus = f"{session.young_modulus_pa / 1000:.1f} kPa"
        rows += [*_title("Friction"), (sticks,), tuple(slips)]
        rows += [
            *_title("Stiffness"),
            (
                Item("softer", do=lambda: session.scale_modulus(1.0 / MODULUS_STEP), size=12),
                Item(modulus, do=session.reset_modulus, tip="As the model has it", size=12),
                Item("stiffer", do=lambda: session.scale_modulus(MODULUS_STEP), size=12),
            ),
        ]
    if session.model.effects:
        on_off = [("on", True), ("off", False)]
        rows += [
            *_title(f"Effects: {', '.join(map(spaced, sorted(session.model.effects)))}"),
            tuple(_choices(session.effects, on_off, session.set_effects)),
        ]
    return rows


def aside_rows(window: TouchWindow) -> list[Row]:
    """What is open on the right."""
    heading = Item("Settings" if window.aside == "s" else "Help", size=16, bold=True, wide=3.0)
    close = Item("Close", do=lambda: window.show_aside(window.aside), size=12, wide=1.2)
    rows = settings_rows(window) if window.aside == "s" else help_rows(window.controls.offered)
    return [(heading, close), *rows]
