"""Make the pictures of pages and of comparisons in `docs/images`, by a browser: `page-demo`, `page-phone`,
`page-diagnosis`, `press`, `press-NAME` of each page of the site, `compare-by-press`, `compare-left-out-foot`.

The demo and the comparison are of the embedded cylinder. The diagnosis is of `palpate simulate block -o
gel.csv.gz --effect viscoelasticity=1 --seed 3 --no-sizes`; the phone shows its page too, in the dark.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from contextlib import chdir
from pathlib import Path
from typing import Any

import palpate as pp
from palpate.mechanics.disk.writing import PNG, atomic_file
from palpate.operations.demo import demo
from palpate.operations.export import export
from palpate.show.comparison import draw
from palpate.show.comparison.figures import across_region
from palpate.show.page import drawn, png_and_drawing
from tests.shell.show.browser import Tab, a_tab
from tools.script import script

FOLDER = Path(__file__).parent.parent / "docs" / "images"
REGION = "base-band"
PRESS, DEPTH_M = 13, 0.006
"""Which press's place of the demo's is pressed on the page, counted from 1, and how deep."""
CARD = 520, 400
"""Pixels of a picture that leads to a page of the site: the object, and the force."""
CARD_STYLE = ".view {position: fixed; inset: 0; height: 100vh; z-index: 9} .view p {display: none}"
ON_CARD = {
    "demo": (0.03, -0.03, 0.05), "silicone-2": (0.02, -0.06, 0.02), "silicone-3": (0.0, -0.03, 0.05),
    "bean": (0.0, -0.03, 0.03), "nodule": (0.014, 0.012, 0.05),
}  # fmt: skip
"""About where each is pressed, m."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Where they go, and the page of the diagnosis."""
    parser.add_argument("diagnosis", type=Path, help="a page of `palpate diagnose REC --report PAGE.html`")
    parser.add_argument("--folder", type=Path, default=FOLDER, help="where they are written")


def run(arguments: argparse.Namespace) -> dict[str, Any]:
    """Write them; nothing to tell of them."""
    folder: Path = arguments.folder
    compared = pp.compare("silicone-1-cylinder", progress=False)
    _write(folder / "compare-by-press.png", drawn(draw, compared, 8, 3.2, layout=None))
    (foot,) = (r.region for r in compared.regions if r.region.name == REGION)
    _write(folder / "compare-left-out-foot.png", across_region(compared, foot.members))
    diagnosis, folder = arguments.diagnosis.resolve(), folder.resolve()
    with tempfile.TemporaryDirectory() as work, chdir(work), a_tab(Path(work) / "profile") as tab:
        demo(window=False)
        tab.open(Path(work) / "palpate-demo" / "report.html", 900, 680)
        tab.picture(folder / "page-demo.png")
        tab.open(diagnosis, 1280, 1000)
        tab.picture(folder / "page-diagnosis.png")
        tab.open(diagnosis, 390, 844, dark=True)
        tab.evaluate("document.querySelector('.view3d').scrollIntoView()")
        tab.picture(folder / "page-phone.png")
        pressed(tab, Path(work), folder / "press.png")
        for name in ON_CARD:
            card(tab, Path(work), name, folder / f"press-{name}.png")
    return {}


def card(tab: Tab, work: Path, name: str, picture: Path) -> None:
    """The picture that leads to the page of a scene: the object alone, under the tip."""
    export(name, to="page", path=work / f"{name}.html")
    tab.open(work / f"{name}.html", *CARD)
    tab.wait("window.palpate !== undefined")
    tab.evaluate(f"document.head.appendChild(document.createElement('style')).textContent = '{CARD_STYLE}'")
    tab.evaluate(f"palpate.page.setDepth({DEPTH_M}); palpate.page.pressInSight({list(ON_CARD[name])})")
    tab.wait("document.getElementById('parts').textContent.includes('deep')")
    tab.evaluate("new Promise((drawn) => setTimeout(drawn, 1000))")
    tab.picture(picture)


def pressed(tab: Tab, work: Path, picture: Path) -> None:
    """The picture of a page to press, under the tip; the page is written to the folder work."""
    export("demo", to="page", path=work / "touch.html")
    tab.open(work / "touch.html", 1180, 670)
    tab.wait("window.palpate !== undefined")
    place = f"palpate.page.presses.points.slice({3 * PRESS - 3}, {3 * PRESS})"
    tab.evaluate(f"palpate.page.setDepth({DEPTH_M}); palpate.page.pressInSight(Array.from({place}))")
    tab.wait("document.getElementById('parts').textContent.includes('deep')")
    tab.evaluate("new Promise((drawn) => setTimeout(drawn, 1000))")
    tab.picture(picture)


def _write(path: Path, figure: Any) -> None:
    with atomic_file(path, PNG) as temporary:
        temporary.write_bytes(png_and_drawing(figure)[0])


if __name__ == "__main__":
    sys.exit(script(sys.modules[__name__]))
