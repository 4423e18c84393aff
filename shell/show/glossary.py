"""The technical words that pages use, in plain words: those of docs/reading/glossary.md, word for word.

Where a page uses one, its first mention is linked to the page's own list of words, which stands at its end.
"""

from __future__ import annotations

import html
import re
from functools import cache

WORDS = {
    "Young's modulus": "how stiff the material is, in Pa; soft silicone has 10 to 100 kPa",
    "Poisson's ratio": "how much it bulges when squeezed: 0.5 keeps its volume, 0.3 does not",
    "finite strain": "large deformation: force grows differently from what small deformations suggest",
    "neo-Hookean": "the simplest law of rubber at large strain",
    "dent law": "how force follows from the local dent under the tip: Hertz, linear, neo-Hookean",
    "far field": "how much the object as a whole deforms, beyond the dent",
    "FEM": "the object cut into small pieces whose deformation is computed",
    "1D model": "spring and damper of one press, interpolated between presses",
    "Kelvin–Voigt": "a 1D model whose force is proportional to depth, with a damper in parallel",
    "Hunt–Crossley": "a 1D model whose force is a power of depth, with a damper in parallel",
    "first touch": "the instant at which a press meets the surface",
    "held out": "left out of the fit, to test it",
    "root mean square": "the usual average of what differs in sign: large differences count most",
    "noise": "the scatter of the sensor itself; no model goes below it",
    "95 %": "holds the true value 19 times of 20, on cases like those it was tested on",
    "resample": "do it again with places drawn at random, to see how far the answer moves",
    "the paper": "Goksel, Jeon, Harders and Székely, Deformable Haptic Model Generation Through Manual "
    "Exploration",
    "renderer": "turns tip positions into forces, a thousand times a second",
    "passivity": "the loop never gives the hand more energy than it took",
    "servo": "the process that runs the 1 kHz loop",
}
"""Word -> what it means, as docs/reading/glossary.md says."""


class Terms:
    """The words that a page has used so far."""

    def __init__(self) -> None:
        self.used: dict[str, str] = {}

    def linked(self, escaped: str) -> str:
        """HTML text (escaped, code marked) with the first mention of each word linked to its meaning."""
        out = []
        for k, piece in enumerate(re.split(r"(<code.*?</code>)", escaped)):
            out.append(piece if k % 2 else _pattern().sub(self._link, piece))
        return "".join(out)

    def _link(self, found: re.Match[str]) -> str:
        word = _known()[found[1].lower().replace("\u00a0", " ")]
        if word in self.used:
            return found[0]
        self.used[word] = _slug(word)
        return f'<a class="term" href="#{self.used[word]}">{found[0]}</a>'

    def listed(self) -> str:
        """The page's list of words; '' where it used none."""
        if not self.used:
            return ""
        entries = "".join(
            f'<dt id="{slug}">{html.escape(word)}</dt><dd>{html.escape(WORDS[word])}</dd>'
            for word, slug in sorted(self.used.items(), key=lambda item: item[0].lower())
        )
        return (
            '<details class="chapter" id="words"><summary><h2>What do the words mean?</h2></summary>'
            f'<dl class="words">{entries}</dl></details>'
        )


def _slug(word: str) -> str:
    return "word-" + re.sub(r"\W+", "-", word.lower()).strip("-")


@cache
def _known() -> dict[str, str]:
    return {html.escape(word).lower(): word for word in WORDS}


@cache
def _pattern() -> re.Pattern[str]:
    words = sorted(_known(), key=len, reverse=True)
    return re.compile(
        r"(?<![\w-])(" + "|".join(map(re.escape, words)).replace(r"\ ", r"\s") + r")s?(?![\w-])",
        re.IGNORECASE,
    )
