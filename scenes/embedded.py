"""The recordings that come with the program, so that everything can be tried without data or network."""

from __future__ import annotations

from pathlib import Path

from palpate.mechanics.errors import SceneError
from palpate.mechanics.names import unknown

FOLDER = Path(__file__).parent / "recordings"
DEFAULT = "silicone-1-cylinder"


def embedded_names() -> list[str]:
    """Names of the embedded recordings."""
    return sorted(p.stem for p in FOLDER.glob("*.toml"))


def embedded_recording(name: str = DEFAULT) -> Path:
    """Path of an embedded recording's description; raises SceneError for an unknown name."""
    path = FOLDER / f"{name}.toml"
    if not path.is_file():
        raise SceneError(unknown(name, "embedded recording", embedded_names()))
    return path
