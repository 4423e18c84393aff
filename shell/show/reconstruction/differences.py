"""What a reconstruction does otherwise than the paper, in sentences with its own figures."""

from __future__ import annotations

import numpy as np

from palpate.reconstruction.pipeline import Reconstruction
from palpate.reconstruction.steps.s6_one_d import low_passed
from palpate.reconstruction.steps.s7_modulus.modulus import ModulusFit
from palpate.show.reconstruction.modulus import height_trends
from palpate.words import mm

_CHANCE = 0.05
"""How often chance alone may do what is called a trend."""
_PAPER_THRESHOLD_N, _PAPER_INDENTATION_M = 1.0, 0.010


def differences(result: Reconstruction) -> list[str]:
    """One paragraph each: touches, first touch, surface, load, law, interval."""
    paragraphs = [_touches(result), _surface(result), _load(result)]
    if result.modulus:
        paragraphs[1:1] = [_first_touch(result)]
        paragraphs += [_law(result.modulus)]
    return [words for words in paragraphs if words]


def _touches(result: Reconstruction) -> str:
    presses, curves = result.exploration.presses, low_passed(result.exploration.presses)
    size = np.linalg.norm(curves.force, axis=1)
    depth, peak = presses.depth_m, np.array([size[curves.rows([i])].max() for i in range(len(presses))])
    return (
        f"Touches. The paper counts contacts above {_PAPER_THRESHOLD_N:g} N and reads each press at "
        f"{mm(_PAPER_INDENTATION_M, 'g')}. Here {len(presses)} presses reach {depth.min() * 1e3:.1f} to "
        f"{mm(depth.max(), '.1f')} and peak at {peak.min():.2f} to {peak.max():.2f} N: "
        f"{np.sum(peak > _PAPER_THRESHOLD_N)} peak above 1 N, {np.sum(depth >= _PAPER_INDENTATION_M)} "
        "reach 10 mm."
    )


def _first_touch(result: Reconstruction) -> str:
    error = np.median(result.exploration.presses.onset_error_m)
    words = (
        "First touch. The paper goes back from its threshold to where the force began to rise. Here a "
        f"contact law is fitted to the rise; its stated error is {mm(error, '.3f')} in the median."
    )
    if result.exploration.delay_s:
        words += (
            f" The force reads {result.exploration.delay_s * 1e3:.0f} ms late, as first and last touch show; "
            "it was shifted before anything else."
        )
    return words


def _surface(result: Reconstruction) -> str:
    surface = result.surface
    hull = surface.bracket_m3[0]
    if surface.method == "hull":
        return (
            "Surface. The convex hull of the touches, as in the paper. Hands do not touch rims, so it lies "
            "inside a convex object."
        )
    if not np.isfinite(hull):
        return (
            f"Surface. The paper takes the convex hull of the touches, here it is a {surface.method}: "
            f"{surface.reason}."
        )
    return (
        f"Surface. The paper takes the convex hull of the touches. Hands do not touch rims: the hull holds "
        f"{100 * hull / surface.volume_m3:.0f} % of the volume of the surface used here "
        f"({surface.method}), which "
        f"{surface.reason}. A smaller object gives more easily, so the hull's modulus comes out too high."
    )


def _load(result: Reconstruction) -> str:
    if result.modulus:
        return (
            "Load. The paper puts the whole force on the node nearest to the contact. A point load has no "
            "limit as the mesh gets finer (table above), so its modulus belongs to its mesh. Here the tip's "
            "own dent follows a law of its size and the mesh carries the deformation of the whole object."
        )
    return (
        "Load. As in the paper, the whole force is put on the node nearest to the contact. A point load has "
        "no limit as the mesh gets finer (table above), so this modulus belongs to this mesh: the same "
        "recording on another mesh gives another one. The paper's own values for its samples #2 and #3 are a "
        "third too low."
    )


def _law(fit: ModulusFit) -> str:
    low, high = (100 * (e / fit.modulus_pa - 1) for e in fit.ci95_pa)
    return (
        "Law and interval. The paper is linear and gives no interval. Here the dent follows the "
        f"{fit.press.law} law (it fits the forces best), and the interval ({low:+.1f} to {high:+.1f} %) "
        "holds the spread between sites, the choice of the law, the shape's uncertainty and 2 % common to "
        "everything."
    )


def trend_words(result: Reconstruction) -> str:
    """Whether stiffness and modulus go with height, in a sentence; '' where nothing can be told."""
    trends = {t.name: t for t in height_trends(result.model)}
    if "e_pa" not in trends or "k_v" not in trends:
        return ""
    k, e = trends["k_v"], trends["e_pa"]
    of_k, of_e = f"{100 * k.change:+.0f} % over the height", f"{100 * e.change:+.1f} %"
    if k.pearson_p > _CHANCE:
        return (
            "Height. In the paper the 1D stiffness of presses on the side goes with the height; here that "
            f"may be chance (k_V changes by {of_k}, the modulus by {of_e})."
        )
    words = f"Height. As in the paper, the 1D stiffness of presses on the side goes with height (k_V: {of_k})"
    if abs(e.change) < 0.25 * abs(k.change):
        return f"{words} and the modulus does not, or much less ({of_e}): as it should be."
    if e.pearson_p > _CHANCE:
        return f"{words}; that the modulus does so ({of_e}) may be chance."
    return f"{words}. Here the modulus does so as well ({of_e}), other than the paper's."
