"""The file that says that a task is finished: its key, what the needs were, what came out."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mechanics.files import atomic_file, sha256_of_file
from palpate.tasks.graph import Task


@dataclass(frozen=True)
class Record:
    """A finished task. value: what its function returned; digest: SHA-256 of that and of the products;
    seconds, cpu_s: of the call; peak_bytes: of the process during it, with its children."""

    key: str
    needs: Mapping[str, str]
    digest: str
    value: Any
    seconds: float
    cpu_s: float
    peak_bytes: int
    host: str


def finished(task: Task, needs: Mapping[str, str]) -> Record | None:
    """The task's record, where it is of this content, made from these needs (name -> digest), and whole."""
    try:
        record = Record(**json.loads(task.record.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None
    same = record.key == task.key and record.needs == dict(needs)
    return record if same and all(path.exists() for path in task.products) else None


def write_record(path: Path, record: Record) -> None:
    """Write it whole; the products are there already."""
    with atomic_file(path) as temporary:
        temporary.write_text(json.dumps(vars(record)) + "\n", encoding="utf-8")


def digest_of(value: Any, products: tuple[Path, ...]) -> str:
    """SHA-256 of a value and of the bytes of files, and of folders' files."""
    digest = hashlib.sha256(json.dumps(value, sort_keys=True).encode())
    for product in products:
        files = sorted(p for p in product.rglob("*") if p.is_file()) if product.is_dir() else [product]
        for path in files:
            digest.update(f"|{path.relative_to(product)}|{sha256_of_file(path)}".encode())
    return digest.hexdigest()
