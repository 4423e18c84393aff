"""One small model for all of the window's tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from mechanics.model import Model

from .small import block_model


@pytest.fixture(scope="session")
def block(tmp_path_factory: pytest.TempPathFactory) -> Model:
    """A block of 20 kPa as a MODEL folder."""
    return block_model(tmp_path_factory.mktemp("model"))


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Models of scenes go into the test's folder."""
    monkeypatch.setenv("PALPATE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"
