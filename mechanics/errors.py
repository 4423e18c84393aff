"""The one exception hierarchy. Libraries raise these; only the command line exits.

Every message says what came, what is allowed and what to do, in one line.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


class PalpateError(Exception):
    """Base of every error that a user can mend; the command line prints it and exits with 2."""


class PalpateWarning(UserWarning):
    """Something is not as it should be, and the work goes on; the command line prints it in one line."""


class FileError(PalpateError, OSError):
    """A file or folder cannot be opened or written, or would be replaced by something of another kind."""


class RecordingError(PalpateError):
    """A recording is unreadable, incomplete, or physically impossible. said: what `palpate open` is to be
    told, by name, so that it is read as it may be meant; empty where nothing is likely."""

    def __init__(self, words: str = "", said: Mapping[str, Any] | None = None) -> None:
        super().__init__(words)
        self.said = said or {}


class ContactError(PalpateError):
    """A recording holds no usable boundary phase or too few palpations."""


class FewPressesError(ContactError):
    """Fewer presses than are asked for. usable: how many there are."""

    def __init__(self, words: str, usable: int = 0) -> None:
        super().__init__(words)
        self.usable = usable


class LoudAirError(ContactError):
    """What the sensor reads in free motion hides the presses."""


class NoBaseError(ContactError):
    """A recording does not trace a base, and none was given."""


class SurfaceError(PalpateError):
    """No closed, oriented surface could be made of the touched points."""


class NotClosedError(SurfaceError):
    """A file's triangles enclose no solid as they are. name: of the file, with which the message begins;
    vertices: (n, 3) m; triangles: (m, 3), as wound in the file."""

    def __init__(self, message: str, name: str, vertices: np.ndarray, triangles: np.ndarray) -> None:
        super().__init__(message)
        self.name, self.vertices, self.triangles = name, vertices, triangles


class MeshError(PalpateError):
    """A tetrahedral mesh is empty, inverted, open or without a fixed base."""


class ModelError(PalpateError):
    """A MODEL folder is missing a file, or its files contradict one another."""


class CacheError(PalpateError):
    """A cached compliance is corrupt or belongs to other content (callers rebuild it)."""


class OptionError(PalpateError):
    """An option or argument is outside what is allowed."""


class DeviceError(PalpateError):
    """A device is absent, refused, unplugged or misbehaving."""


class SceneError(PalpateError):
    """A scene or phantom is unknown or wrongly described."""


class DiagnosisError(PalpateError):
    """The data cannot carry a diagnosis (too few palpations, no model that fits)."""
