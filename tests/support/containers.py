"""One table in the kinds of file that people keep tables in beside text."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np
from scipy.io import savemat


@dataclass(frozen=True)
class Content:
    """head: the columns' names; units: of each, None where nobody says them; table: (n, k); remarks: lines
    before."""

    head: Sequence[str]
    units: Sequence[str] | None
    table: np.ndarray
    remarks: Sequence[str]

    def rows(self, form: int) -> list[list[str | float]]:
        """As cells, the units in brackets of two kinds or in a line of their own (form 0 to 2)."""
        names, units = list(self.head), self.units
        lines: list[list[str | float]] = [[remark] for remark in self.remarks]
        if units is None:
            lines.append([*names])
        elif form < 2:
            left, right = "[]" if form == 0 else "()"
            lines.append([f"{n} {left}{u}{right}" for n, u in zip(names, units, strict=True)])
        else:
            lines += [[*names], [*units]]
        return [*lines, *self.table.tolist()]

    def named(self) -> dict[str, np.ndarray]:
        """Columns by names that a program allows: Depth_mm."""
        units = self.units or [""] * len(self.head)
        names = [f"{n}_{u}" if u else n for n, u in zip(self.head, units, strict=True)]
        return {re.sub(r"\W", "_", n.replace("µ", "u")): v for n, v in zip(names, self.table.T, strict=True)}


def _xlsx(path: Path, content: Content, form: int, plain: bool) -> None:
    def cell(value: str | float) -> str:
        if isinstance(value, str):
            return f'<c t="inlineStr"><is><t>{escape(value)}</t></is></c>'
        return f"<c><v>{value!r}</v></c>"

    rows = "".join(f"<row>{''.join(map(cell, row))}</row>" for row in content.rows(form))
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{package}/content-types"><Default Extension="rels" '
        'ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="xml" '
        'ContentType="application/xml"/><Override PartName="/xl/workbook.xml" ContentType="application/'
        'vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"/></Types>',
        "_rels/.rels": f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
        f'Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets><sheet name="Data" '
        'sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
        f'Type="{office}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
        "xl/worksheets/sheet1.xml": f'<worksheet xmlns="{main}"><sheetData>{rows}</sheetData></worksheet>',
    }
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        for name, text in parts.items():
            file.writestr(name, '<?xml version="1.0" encoding="UTF-8"?>' + text)


def _ods(path: Path, content: Content, form: int, plain: bool) -> None:
    def cell(value: str | float) -> str:
        if isinstance(value, str):
            kind = 'office:value-type="string"'
            return f"<table:table-cell {kind}><text:p>{escape(value)}</text:p></table:table-cell>"
        return f'<table:table-cell office:value-type="float" office:value="{value!r}"/>'

    rows = "".join(
        f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in content.rows(form)
    )
    name = "urn:oasis:names:tc:opendocument:xmlns"
    spaces = " ".join(f'xmlns:{n}="{name}:{n}:1.0"' for n in ("office", "table", "text"))
    kind = "application/vnd.oasis.opendocument.spreadsheet"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("mimetype", kind, zipfile.ZIP_STORED)
        file.writestr(
            "META-INF/manifest.xml",
            f'<manifest:manifest xmlns:manifest="{name}:manifest:1.0"><manifest:file-entry '
            f'manifest:full-path="/" manifest:media-type="{kind}"/></manifest:manifest>',
        )
        file.writestr(
            "content.xml",
            f"<office:document-content {spaces}><office:body><office:spreadsheet><table:table "
            f'table:name="Data">{rows}</table:table></office:spreadsheet></office:body>'
            "</office:document-content>",
        )


def _npz(path: Path, content: Content, form: int, plain: bool) -> None:
    arrays: dict[str, Any] = content.named()
    np.savez(path, **arrays)


def _npy(path: Path, content: Content, form: int, plain: bool) -> None:
    if plain:
        np.save(path, content.table)
        return
    columns = content.named()
    held = np.zeros(len(content.table), dtype=[(name, float) for name in columns])
    for name, values in columns.items():
        held[name] = values
    np.save(path, held)


def _mat(path: Path, content: Content, form: int, plain: bool) -> None:
    columns = content.named()
    savemat(path, {"data": columns} if form == 0 else columns)


def _bag(path: Path, content: Content, form: int, plain: bool) -> None:
    """Two topics of ROS 2: poses and wrenches, their stamps alike."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kind = {name.rsplit("/", 1)[1]: made for name, made in store.types.items() if "msg" in name}
    with Writer(path, version=9) as writer:
        poses = writer.add_connection("/tcp_pose", "geometry_msgs/msg/PoseStamped", typestore=store)
        pushes = writer.add_connection("/wrench", "geometry_msgs/msg/WrenchStamped", typestore=store)
        for t, *values in content.table.tolist():
            stamp = kind["Time"](sec=int(t), nanosec=round((t - int(t)) * 1e9))
            header = store.types["std_msgs/msg/Header"](stamp=stamp, frame_id="base")
            point, vector = store.types["geometry_msgs/msg/Point"], store.types["geometry_msgs/msg/Vector3"]
            turn = store.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
            pose = store.types["geometry_msgs/msg/Pose"](point(*values[:3]), turn)
            wrench = store.types["geometry_msgs/msg/Wrench"](vector(*values[3:]), vector(0.0, 0.0, 0.0))
            for connection, message in (
                (poses, store.types[poses.msgtype](header, pose)),
                (pushes, store.types[pushes.msgtype](header, wrench)),
            ):
                writer.write(connection, int(1e9 * t), store.serialize_cdr(message, connection.msgtype))


def _mcap(path: Path, content: Content, form: int, plain: bool) -> None:
    """JSON messages of one topic."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(name="probe", encoding="jsonschema", data=b"{}")
        channel = writer.register_channel(topic="probe", message_encoding="json", schema_id=schema)
        for t, *values in content.table.tolist():
            names = ("position", "force")
            parts = (dict(zip("xyz", part, strict=True)) for part in (values[:3], values[3:]))
            data = json.dumps(dict(zip(names, parts, strict=True))).encode()
            writer.add_message(channel, log_time=round(1e9 * t), publish_time=round(1e9 * t), data=data)
        writer.finish()


WRITERS: dict[str, Callable[[Path, Content, int, bool], None]] = {
    "xlsx": _xlsx, "ods": _ods, "npz": _npz, "npy": _npy, "mat": _mat, "bag": _bag, "mcap": _mcap,
}  # fmt: skip
"""By the file's kind: (path, content, form of the units, without names)."""
