"""Recordings as strangers write them: either body's force, names and further columns in any script."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np

from benchmarks.varied.draws import Draw
from palpate.mechanics.disk.toml_text import dump_toml
from palpate.mechanics.disk.writing import atomic_file
from palpate.mechanics.recording.recording import (
    QUATERNION_COLUMNS,
    REQUIRED_COLUMNS,
    Recording,
    description_table,
)

SCRIPTS = (
    ("silicone sample", "recorded in the morning", "temperature"),
    ("Silikonzylinder für Übungen", "größter Druck am Rand vermeiden", "Wärme in °C"),
    ("силикон № 3", "записано утром, стол не двигали", "температура"),
    ("硅胶圆柱", "早上记录，桌子没有动", "温度"),
    ("シリコーンの試料", "朝に記録しました", "温度"),
    ("عينة سيليكون", "سُجّلت في الصباح", "حرارة"),
    ("דגימת סיליקון", "הוקלט בבוקר", "טמפרטורה"),
    ("सिलिकॉन नमूना", "सुबह दर्ज किया गया", "तापमान"),
    ("σιλικόνη δείγμα", "καταγράφηκε το πρωί", "θερμοκρασία"),
    ("실리콘 시편", "아침에 기록함", "온도"),
    ("ตัวอย่างซิลิโคน", "บันทึกตอนเช้า", "อุณหภูมิ"),
    ("silicone 🫠 №1", "“quotes”, a # sign and a \\ backslash", "T/°C"),
)
"""(name of the object, comment, name of a further column)."""


def object_name(draw: Draw) -> str:
    """What the person calls the object."""
    return SCRIPTS[draw.script % len(SCRIPTS)][0]


def write(path: Path, recording: Recording, draw: Draw) -> Path:
    """Write `NAME.csv.gz` and `NAME.toml`; every third with a further column before the forces."""
    _, comment, column = SCRIPTS[draw.script % len(SCRIPTS)]
    sign = -1.0 if draw.force_on_object else 1.0
    names = list(REQUIRED_COLUMNS)
    columns = [recording.t[:, None], recording.position, sign * recording.force_on_tool]
    formats = ["%.6f"] + ["%.9f"] * 3 + ["%.6f"] * 3
    if recording.quaternion is not None:
        columns.append(recording.quaternion)
        formats += ["%.7f"] * 4
        names += QUATERNION_COLUMNS
    if draw.script % 3 == 0:
        names.insert(4, column)
        columns.insert(2, np.full((len(recording.t), 1), 21.5))
        formats.insert(4, "%.1f")
    rows = np.hstack(columns)
    with (
        atomic_file(path) as temporary,
        gzip.open(temporary, "wt", encoding="utf-8", newline="\n", compresslevel=4) as file,
    ):
        np.savetxt(file, rows, fmt=formats, delimiter=",", header=",".join(names), comments="")
    table = description_table(recording)
    table["recording"]["force_on"] = "object" if draw.force_on_object else "tool"
    if not draw.tool_mass_stated:
        del table["tool"]["mass_kg"]
    text = f"# {comment}\n{dump_toml(table)}"
    with atomic_file(path.with_name(path.name.removesuffix(".csv.gz") + ".toml")) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path
