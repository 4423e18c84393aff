"""ROS bags: every topic a table of its messages' numbers, with the time of its stamp or of its log."""

from __future__ import annotations

from pathlib import Path

from palpate.importing.tables import Table, flattened, of_messages


def read(path: Path) -> list[Table]:
    """A ROS 1 bag, or a ROS 2 bag's folder (or its .db3)."""
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    if path.suffix == ".db3":
        path = path.parent
    kept: dict[str, tuple[list[float], list[dict[str, float]]]] = {}
    with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, stamp, raw in reader.messages():
            times, messages = kept.setdefault(connection.topic, ([], []))
            times.append(1e-9 * stamp)
            messages.append(flattened("", reader.deserialize(raw, connection.msgtype)))
    return [of_messages(topic, *held) for topic, held in kept.items()]
