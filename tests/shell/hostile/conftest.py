"""Files to spoil. All of this is about limits and links as POSIX has them."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import pytest

from palpate.mechanics.model.files import write_model

from .inputs import DESCRIPTION, block, rows, text_of

collect_ignore_glob = [] if importlib.util.find_spec("resource") else ["test_*.py"]


@pytest.fixture
def record(tmp_path):
    """Writes REC.csv and REC.toml as they are given; returns the samples' path."""

    def written(samples=None, description=DESCRIPTION, ending=".csv"):
        path = tmp_path / f"rec{ending}"
        samples = text_of(rows()) if samples is None else samples
        path.write_bytes(samples if isinstance(samples, bytes) else samples.encode())
        given = description if isinstance(description, bytes) else description.encode()
        (tmp_path / "rec.toml").write_bytes(given)
        return path

    return written


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    return write_model(tmp_path_factory.mktemp("models") / "sound", block())


@pytest.fixture
def folder(sound, tmp_path):
    return Path(shutil.copytree(sound, tmp_path / "model"))
