"""One small model for the tests of the window and of the page that can be pressed."""

from __future__ import annotations

from pathlib import Path

import pytest

from palpate.mechanics.model.files import read_model
from palpate.mechanics.model.model import Model
from palpate.render.registry import create
from palpate.render.surface.felt_surface import with_own_stiffness

from ..support.once import folder_made_once
from .window.small import block_model


@pytest.fixture(scope="session")
def block(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """A block of 20 kPa as a MODEL folder, condensed, with the stiffness of its surface; only to be read."""

    def make(folder: Path) -> None:
        with_own_stiffness(create("fem", block_model(folder)))

    return read_model(folder_made_once(tmp_path_factory, "window-block", make) / "block")
