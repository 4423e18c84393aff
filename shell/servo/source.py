"""Where the servo process gets its renderer from: small recipes that can be pickled."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from palpate.mechanics.disk.scratch import sweep, temporary_prefix
from palpate.mechanics.model.files import read_model, write_model
from palpate.mechanics.model.model import Model
from palpate.mechanics.progress import Progress


class RendererSource(Protocol):
    """Makes a renderer in the servo process."""

    @property
    def name(self) -> str:
        """The renderer's."""

    def make(self, progress: Progress) -> tuple[Any, Model | None]:
        """The renderer, and the model behind it where there is one."""


@dataclass(frozen=True)
class ModelSource:
    """A renderer by name on a MODEL folder; render_options are the renderer's own, None for defaults."""

    path: Path
    name: str = "fem"
    render_options: Any = None

    def make(self, progress: Progress) -> tuple[Any, Model | None]:
        """Read the model, load or condense its compliance."""
        from palpate import render

        model = read_model(self.path)
        keywords = {} if self.render_options is None else {"options": self.render_options}
        return render.create(self.name, model, progress=progress, **keywords), model

    def named(self, name: str, options: Any = None) -> ModelSource:
        """The same model through another renderer; options: None for those of before."""
        kept = self.render_options if options is None else options
        return replace(self, name=name, render_options=kept)


class RendererChange(Protocol):
    """Makes another renderer of the running one, of the same arrays' shapes; touches go on through it."""

    def changed(self, renderer: Any) -> Any:
        """The other renderer."""


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
