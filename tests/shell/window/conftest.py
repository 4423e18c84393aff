"""What the window's tests share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Models of scenes go into the test's folder."""
    monkeypatch.setenv("PALPATE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"
