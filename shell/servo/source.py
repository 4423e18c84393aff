"""Where the servo process gets its renderer from: small recipes that can be pickled."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from palpate.mechanics.disk.scratch import sweep, temporary_prefix
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress
from palpate.render.fem.renderer import FemRenderer


class RendererSource(Protocol):
    """Makes a renderer in the servo process."""

    @property
    def name(self) -> str:
        """The renderer's."""

    def make(self, progress: Progress) -> tuple[Any, Model | None]:
        """The renderer, and the model behind it where there is one."""


@dataclass(frozen=True)
class ModelSource:
    """A renderer by name on a MODEL folder; render_options are the renderer's own, None for defaults. coarse:
    it renders at once what is kept of the compliance (render.registry.create)."""

    path: Path
    name: str = "fem"
    render_options: Any = None
    coarse: bool = False

    def make(self, progress: Progress) -> tuple[Any, Model | None]:
        """Read the model, load or condense its compliance."""
        from palpate import render

        model = read_model(self.path)
        keywords = {} if self.render_options is None else {"options": self.render_options}
        made = render.create(self.name, model, progress=progress, coarse=self.coarse, **keywords)
        return made, model

    def named(self, name: str, options: Any = None) -> ModelSource:
        """The same model through another renderer; options: None for those of before."""
        kept = self.render_options if options is None else options
        return replace(self, name=name, render_options=kept)


class RendererChange(Protocol):
    """Makes another renderer of the running one, of the same arrays' shapes; touches go on through it."""

    def changed(self, renderer: Any) -> Any:
        """The other renderer."""


@dataclass(frozen=True)
class FieldChange:
    """The far field (v, 3, 3) of an object that changed, or is known better; the bracing (v,) and the table
    between its places where those changed, of no size where not: in a file, for renderers in any process."""

    path: Path

    @classmethod
    def written(
        cls, path: Path, far: np.ndarray, blocks: np.ndarray | None = None, bracing: np.ndarray | None = None
    ) -> FieldChange:
        """To a file; None where the table between places, or the bracing, stays."""
        with open(path, "wb") as file:
            np.savez(
                file, far=far, blocks=np.zeros((0, 0, 3, 3)) if blocks is None else blocks,
                bracing=np.zeros(0) if bracing is None else bracing,
            )  # fmt: skip
        return cls(path)

    def changed(self, renderer: Any) -> Any:
        """The renderer on the changed object; one-dimensional ones know nothing of what is inside."""
        return self.laid_on(renderer) if isinstance(renderer, FemRenderer) else renderer

    def laid_on(self, renderer: FemRenderer) -> FemRenderer:
        """The renderer on the changed object; one that knows nothing between places has no table to
        change."""
        with np.load(self.path) as arrays:
            table = len(arrays["blocks"]) and len(renderer.parameters.blocks)
            bracing = arrays["bracing"] if len(arrays["bracing"]) else None
            return renderer.with_field(arrays["far"], arrays["blocks"] if table else None, bracing)


class ModelFolder:
    """A MODEL folder for a model that may be in memory only; `close` removes what was written for it."""

    def __init__(self, model: Model | Path | str) -> None:
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        if isinstance(model, Model):
            if model.path is not None:
                self.path = model.path
                return
            sweep(Path(tempfile.gettempdir()))
            self._temporary = tempfile.TemporaryDirectory(prefix=temporary_prefix())
            self.path = write_model(Path(self._temporary.name) / "model", model)
        else:
            self.path = Path(model)

    def close(self) -> None:
        """Remove the folder where it was made for this."""
        if self._temporary is not None:
            self._temporary.cleanup()
