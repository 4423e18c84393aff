"""One colour a thing, on every page and in the window: nothing else in `show` and `window` names one."""

from __future__ import annotations

COLOURS = {
    # forces, and the models that they are of
    "measured": "#1d3557",
    "fem": "#e0662f",
    "fem-homogeneous": "#f2a884",
    "kelvin-voigt": "#7b4fc9",
    "hunt-crossley": "#2f7fd6",
    "other-simulator": "#b8327a",
    "simplest": "#8c5a3c",
    "found": "#1f8a7c",
    "not-ruled-out": "#d9a021",
    "noise": "#4a5560",
    # the object, the tool, what is done with them
    "object": "#ead7bf",
    "mesh": "#b9a88f",
    "support": "#d9dee5",
    "base": "#51657d",
    "tip": "#8f9aa8",
    "inclusion": "#7b1fa2",
    "displaced": "#a61c1c",
    "touch": "#c1121f",
    "peak": "#a3386c",
    "path": "#b8c0cc",
    "base-tracing": "#f1e3cf",
    "next-touch": "#1a9850",
    # directions
    "x": "#b3261e",
    "y": "#2e7d32",
    "z": "#1b4f9c",
    # quantities
    "press": "#457b9d",
    "whole": "#d1495b",
    "interval": "#dde3ec",
    "modulus": "#3d5a80",
    "surface": "#b7791f",
    "goal": "#4b8f29",
    "depth": "#6b7f2a",
    "change": "#c0392b",
    "reference": "#999999",
    "first": "#33658a",
    "second": "#bc4b51",
    # parts of a gap
    "numerics": "#5e548e",
    "parameters": "#6a994e",
    "reality": "#b56576",
    "unexplained": "#c9c9c9",
    # what is wrong
    "grave": "#9b1c1c",
    "finding": "#f3d9a4",
}
"""Thing -> its colour on white."""
ON_BLACK = {
    "measured": "#a9c7ee",
    "fem": "#ff9461",
    "fem-homogeneous": "#c98a6b",
    "kelvin-voigt": "#b79cf0",
    "hunt-crossley": "#6db0f7",
    "other-simulator": "#f08abf",
    "simplest": "#c99a7c",
    "found": "#4fd0be",
    "object": "#cdb99f",
    "touch": "#ff5964",
    "tip": "#aab6c4",
}
"""The same where a page is dark: lighter, of the same hue."""
UNNAMED = ("#8e5bd0", "#c2571a", "#0f8b8d", "#b5179e", "#6f9f52", "#3a86ff", "#bc6c25", "#7b8794")
"""Of curves that are compared once and have no name in the table, in order."""


INK, GREY, ACCENT, WARNING = "#1c2430", "#667080", "#1f7d72", COLOURS["grave"]
STAGE, PAPER, BUTTON, OVER, HINT, NIGHT = "#f4f6f8", "#ffffff", "#e9edf3", "#d3dded", "#e6f3f1", "#2b3442"
"""Of the window around the things: words, buttons, what stands behind."""


def colour_of(thing: str) -> str:
    """A thing's colour; a variant of a model (`hunt-crossley-kh`) has the model's, a model that is not in the
    table another simulator's."""
    known = (name for name in COLOURS if thing == name or thing.startswith(f"{name}-"))
    return COLOURS[max(known, key=len, default="other-simulator")]


def style_sheet() -> str:
    """The table as CSS variables (`--measured`, `--unnamed-0` …), for light and dark pages."""
    unnamed = {f"unnamed-{k}": colour for k, colour in enumerate(UNNAMED)}
    return f":root {{{_variables(COLOURS | unnamed)}}}" + (
        f"@media (prefers-color-scheme: dark) {{:root {{{_variables(ON_BLACK)}}}}}"
    )


def _variables(colours: dict[str, str]) -> str:
    return "".join(f"--{name}:{colour};" for name, colour in colours.items())
