"""Shapes of every family at random sizes: round and edged, concave and slender; object frame."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from palpate.scenes.phantoms import SPACING_M, Phantom, circle, column, cushion, rectangle, resampled, stacked

Built = tuple[str, np.ndarray, np.ndarray]
"""(one line in words and metres, vertices (n, 3) m, faces (m, 3))."""


def _upright(words: str, outline: np.ndarray, height: float) -> Built:
    """An upright wall over an outline (n, 2) m, with a flat top."""
    reach = float(np.linalg.norm(outline, axis=1).mean())
    return (f"{words}, height {height:.3f}", *stacked(outline, column(reach, height)))


def _topped(words: str, outline: np.ndarray, top: Callable[[np.ndarray], np.ndarray]) -> Built:
    """An upright wall over an outline up to `top(xy (..., 2)) -> (...)` m."""
    reach, high = float(np.linalg.norm(outline, axis=1).mean()), float(top(outline).max())
    built = stacked(outline, column(reach, high), lambda xy, z: z / high * top(xy))
    return (words, *built)


def _tapered(words: str, outline: np.ndarray, height: float, share: float) -> Built:
    """A wall that narrows to `share` of its outline at `height`, with a flat top."""
    reach = float(np.linalg.norm(outline, axis=1).mean())
    corners = np.array([[0.0, 0.0], [reach, 0.0], [share * reach, height], [0.0, height]])
    path = resampled(corners, SPACING_M)
    built = stacked(outline, np.column_stack([path[:, 0] / reach, path[:, 1]]))
    return (f"{words}, height {height:.3f}, top {share:.2f} of the base", *built)


def _domed(words: str, outline: np.ndarray, height: float, exponent: float, lean: float = 0.0) -> Built:
    """A wall that bends over into a cap, leaning aside by `lean` at its top as a share of the height."""
    reach = float(np.linalg.norm(outline, axis=1).mean())
    vertices, faces = stacked(outline, cushion(height, exponent, reach))
    vertices = vertices.copy()
    vertices[:, 0] += lean * vertices[:, 2] ** 2 / height
    return f"{words}, height {height:.3f}", vertices, faces


def _polar(radius: Callable[[np.ndarray], np.ndarray], mean: float) -> np.ndarray:
    """(n, 2) m, counter-clockwise: a star-shaped outline."""
    count = 8 * int(np.ceil(2 * np.pi * mean / SPACING_M / 8))
    angle = 2 * np.pi * np.arange(count) / count
    return radius(angle)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def _ellipse(a: float, b: float) -> np.ndarray:
    return _polar(lambda t: 1 / np.sqrt((np.cos(t) / a) ** 2 + (np.sin(t) / b) ** 2), (a + b) / 2)


def cylinder(rng: np.random.Generator) -> Built:
    """Upright and round."""
    radius = rng.uniform(0.022, 0.055)
    return _upright(f"cylinder radius {radius:.3f}", circle(radius), rng.uniform(0.025, 0.090))


def slender_column(rng: np.random.Generator) -> Built:
    """A round column two to three times as high as wide."""
    radius = rng.uniform(0.015, 0.022)
    return _upright(f"column radius {radius:.3f}", circle(radius), radius * rng.uniform(4, 6))


def block(rng: np.random.Generator) -> Built:
    """A rectangular block."""
    length, width = rng.uniform(0.050, 0.120), rng.uniform(0.045, 0.100)
    return _upright(f"block {length:.3f} x {width:.3f}", rectangle(length, width), rng.uniform(0.025, 0.060))


def slender_bar(rng: np.random.Generator) -> Built:
    """A bar that lies on its long side."""
    length, width = rng.uniform(0.110, 0.150), rng.uniform(0.032, 0.042)
    return _upright(f"bar {length:.3f} x {width:.3f}", rectangle(length, width), rng.uniform(0.026, 0.036))


def sphere_cap(rng: np.random.Generator) -> Built:
    """A sphere cut by the support."""
    radius = rng.uniform(0.035, 0.070)
    height = radius * rng.uniform(0.75, 1.0)
    angle = np.linspace(-np.arcsin((height - radius) / radius), np.pi / 2, int(2.2 * radius / SPACING_M))
    cap = np.column_stack([radius * np.cos(angle), height - radius + radius * np.sin(angle)])
    cap[0, 1], cap[-1] = 0.0, (0.0, height)
    path = np.vstack([resampled(np.array([[0.0, 0.0], cap[0]]), SPACING_M)[:-1], cap])
    profile = np.column_stack([path[:, 0] / cap[0, 0], path[:, 1]])
    return (f"sphere radius {radius:.3f} cut to height {height:.3f}", *stacked(circle(cap[0, 0]), profile))


def dome(rng: np.random.Generator) -> Built:
    """A round cushion that leans a little."""
    radius = rng.uniform(0.035, 0.065)
    height = radius * rng.uniform(0.65, 1.0)
    return _domed(
        f"dome radius {radius:.3f}", circle(radius), height, rng.uniform(2, 3.2), rng.uniform(0, 0.2)
    )


def ellipsoid(rng: np.random.Generator) -> Built:
    """Half of an ellipsoid."""
    a, b = rng.uniform(0.045, 0.070), rng.uniform(0.030, 0.050)
    return _domed(f"half ellipsoid {a:.3f} x {b:.3f}", _ellipse(a, b), rng.uniform(0.030, 0.055), 2.0)


def blob(rng: np.random.Generator) -> Built:
    """A lopsided lump on a pear-shaped base."""
    mean, (p, q) = rng.uniform(0.038, 0.055), rng.uniform(-3, 3, 2)
    outline = _polar(lambda t: mean * (1 + 0.15 * np.cos(t - p) + 0.06 * np.cos(3 * t - q)), mean)
    return _domed(f"pear of mean radius {mean:.3f}", outline, rng.uniform(0.030, 0.050), 2.4, 0.15)


def bean(rng: np.random.Generator) -> Built:
    """A kidney: not convex."""
    a, b, deep = rng.uniform(0.048, 0.060), rng.uniform(0.034, 0.042), rng.uniform(0.42, 0.55)

    def radius(t: np.ndarray) -> np.ndarray:
        turn = np.angle(np.exp(1j * (t + np.pi / 2)))
        oval = 1 / np.sqrt((np.cos(t) / a) ** 2 + (np.sin(t) / b) ** 2)
        return oval * (1 - deep * np.exp(-((turn / 0.75) ** 2)))

    words = f"kidney {2 * a:.3f} x {2 * b:.3f}, dent {deep:.2f} of its side"
    return _domed(words, _polar(radius, 0.045), rng.uniform(0.034, 0.050), rng.uniform(2.6, 3.2))


def bowl(rng: np.random.Generator) -> Built:
    """A round block with a spherical dish in its top: not convex."""
    radius, height = rng.uniform(0.042, 0.056), rng.uniform(0.038, 0.056)
    mouth, deep = radius - 0.012, rng.uniform(0.006, 0.35 * height)
    ball = (mouth**2 + deep**2) / (2 * deep)
    half = np.arcsin(min(mouth / ball, 1.0))
    angle = np.linspace(half, 0.0, int(np.ceil(ball * half / SPACING_M)) + 1)
    dish = np.column_stack([ball * np.sin(angle), height - deep + ball * (1 - np.cos(angle))])
    dish[0], dish[-1, 0] = (mouth, height), 0.0
    corners = np.array([[0.0, 0.0], [radius, 0.0], [radius, height], [mouth, height]])
    path = np.vstack([resampled(corners, SPACING_M), dish[1:]])
    profile = np.column_stack([path[:, 0] / radius, path[:, 1]])
    words = f"round block radius {radius:.3f} height {height:.3f}, dish {deep:.3f} deep"
    return (words, *stacked(circle(radius), profile))


def angle_piece(rng: np.random.Generator) -> Built:
    """An L-shaped block: not convex."""
    width, long, short = rng.uniform(0.034, 0.044), rng.uniform(0.085, 0.110), rng.uniform(0.075, 0.095)
    half = width / 2
    corners = [(-half, -half), (long - half, -half), (long - half, half), (half, half),
               (half, short - half), (-half, short - half), (-half, -half)]  # fmt: skip
    outline = resampled(np.array(corners), SPACING_M)[:-1]
    words = f"L-shaped block {long:.3f} x {short:.3f}, limbs {width:.3f} wide"
    return _upright(words, outline, rng.uniform(0.028, 0.045))


def polygon(rng: np.random.Generator) -> Built:
    """A regular prism of three to eight sides."""
    sides, radius = int(rng.integers(3, 9)), rng.uniform(0.038, 0.058)
    radius *= 1.25 if sides == 3 else 1.0
    angle = 2 * np.pi * np.arange(sides + 1) / sides
    outline = resampled(radius * np.column_stack([np.cos(angle), np.sin(angle)]), SPACING_M)[:-1]
    return _upright(f"prism of {sides} sides, {radius:.3f} to a corner", outline, rng.uniform(0.028, 0.060))


def frustum(rng: np.random.Generator) -> Built:
    """A pyramid cut flat."""
    length, width = rng.uniform(0.070, 0.110), rng.uniform(0.060, 0.090)
    outline = rectangle(length, width)
    words = f"pyramid {length:.3f} x {width:.3f}"
    return _tapered(words, outline, rng.uniform(0.030, 0.055), rng.uniform(0.5, 0.9))


def cone(rng: np.random.Generator) -> Built:
    """A round cone cut flat."""
    radius = rng.uniform(0.038, 0.055)
    words = f"cone radius {radius:.3f}"
    return _tapered(words, circle(radius), rng.uniform(0.035, 0.070), rng.uniform(0.45, 0.9))


def wedge(rng: np.random.Generator) -> Built:
    """A block whose top slopes."""
    length, width = rng.uniform(0.070, 0.110), rng.uniform(0.055, 0.085)
    low, rise = rng.uniform(0.026, 0.040), rng.uniform(0.008, 0.028)
    words = f"wedge {length:.3f} x {width:.3f}, height {low:.3f} to {low + rise:.3f}"
    return _topped(words, rectangle(length, width), lambda p: low + rise * (p[..., 0] / length + 0.5))


def gable(rng: np.random.Generator) -> Built:
    """A house with a ridge."""
    length, width = rng.uniform(0.080, 0.110), rng.uniform(0.060, 0.080)
    wall, rise = rng.uniform(0.024, 0.034), rng.uniform(0.010, 0.022)
    words = f"gable {length:.3f} x {width:.3f}, walls {wall:.3f}, ridge {wall + rise:.3f}"
    return _topped(
        words, rectangle(length, width), lambda p: wall + rise * (1 - np.abs(p[..., 1]) / (width / 2))
    )


def vault(rng: np.random.Generator) -> Built:
    """A barrel vault on low walls."""
    length, width = rng.uniform(0.080, 0.110), rng.uniform(0.060, 0.084)
    wall, arch = rng.uniform(0.014, 0.024), rng.uniform(0.5, 0.95) * width / 2
    radius = ((width / 2) ** 2 + arch**2) / (2 * arch)

    def top(p: np.ndarray) -> np.ndarray:
        return wall + arch - radius + np.sqrt(np.maximum(radius**2 - p[..., 1] ** 2, 0.0))

    words = f"vault {length:.3f} x {width:.3f}, height {wall + arch:.3f}"
    return _topped(words, rectangle(length, width), top)


def saddle(rng: np.random.Generator) -> Built:
    """A round block whose top is a saddle."""
    radius, middle = rng.uniform(0.042, 0.056), rng.uniform(0.036, 0.048)
    bend = rng.uniform(0.004, 0.009) / radius**2
    words = f"round block radius {radius:.3f}, saddle about {middle:.3f}"
    return _topped(words, circle(radius), lambda p: middle + bend * (p[..., 0] ** 2 - p[..., 1] ** 2))


def bullet(rng: np.random.Generator) -> Built:
    """An upright column with half a ball on top."""
    radius, wall = rng.uniform(0.024, 0.040), rng.uniform(0.018, 0.040)
    angle = np.linspace(0.0, np.pi / 2, int(np.ceil(1.6 * radius / SPACING_M)) + 1)
    ball = np.column_stack([radius * np.cos(angle), wall + radius * np.sin(angle)])
    ball[-1, 0] = 0.0
    floor = resampled(np.array([[0.0, 0.0], [radius, 0.0], [radius, wall]]), SPACING_M)
    path = np.vstack([floor, ball[1:]])
    profile = np.column_stack([path[:, 0] / radius, path[:, 1]])
    return (
        f"bullet radius {radius:.3f}, height {wall + radius:.3f}",
        *stacked(circle(radius), profile),
    )


def soap(rng: np.random.Generator) -> Built:
    """A block with rounded upper edges."""
    length, width, height = rng.uniform(0.070, 0.115), rng.uniform(0.052, 0.080), rng.uniform(0.030, 0.048)
    edge = rng.uniform(0.006, 0.014)

    def top(p: np.ndarray) -> np.ndarray:
        inside = np.minimum(length / 2 - np.abs(p[..., 0]), width / 2 - np.abs(p[..., 1]))
        fall = np.maximum(edge - np.maximum(inside, 0.0), 0.0)
        return height - edge + np.sqrt(np.maximum(edge**2 - fall**2, 0.0))

    words = f"soap {length:.3f} x {width:.3f} x {height:.3f}, edges rounded by {edge:.3f}"
    outline = rectangle(length, width)
    return _topped(words, outline, top)


FAMILIES: dict[str, Callable[[np.random.Generator], Built]] = {
    f.__name__.replace("_", "-"): f
    for f in (
        cylinder, block, sphere_cap, dome, bean, wedge, bowl, slender_column, ellipsoid, angle_piece,
        frustum, soap, vault, cone, slender_bar, polygon, blob, saddle, gable, bullet,
    )
}  # fmt: skip
"""Every family by its name."""

CONCAVE = ("bean", "bowl", "angle-piece", "saddle")
SLENDER = ("slender-column", "slender-bar")


def shape(number: int) -> Phantom:
    """The `number`-th shape: families in turn, sizes by chance; its material left as it is."""
    family = list(FAMILIES)[number % len(FAMILIES)]
    words, vertices, faces = FAMILIES[family](np.random.default_rng([3, number]))
    return Phantom(f"{family}-{number}", words, vertices, faces, 20e3)
