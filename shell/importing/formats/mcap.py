"""MCAP: every topic a table of its messages' numbers, with the time of its stamp or of its log."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from palpate.importing.tables import Table, flattened, of_messages


def read(path: Path) -> list[Table]:
    """JSON and ROS messages of an MCAP file."""
    from mcap.reader import make_reader

    kept: dict[str, tuple[list[float], list[dict[str, float]]]] = {}
    decoders: dict[str, Any] = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.message_encoding == "json":
                content = json.loads(message.data)
            elif channel.message_encoding in ("cdr", "ros1") and schema is not None:
                key = f"{channel.message_encoding} {schema.name}"
                if key not in decoders:
                    decoders[key] = _decoder(channel.message_encoding, schema.name, schema.data.decode())
                content = decoders[key](message.data)
            else:
                continue
            times, messages = kept.setdefault(channel.topic, ([], []))
            times.append(1e-9 * message.log_time)
            messages.append(flattened("", content))
    return [of_messages(topic, *held) for topic, held in kept.items()]


def _decoder(encoding: str, name: str, definition: str) -> Any:
    """From bytes to a message of that type."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    kind = name if name.count("/") == 2 else name.replace("/", "/msg/")
    store = get_typestore(Stores.ROS2_HUMBLE if encoding == "cdr" else Stores.ROS1_NOETIC)
    if kind not in store.fielddefs:
        store.register(get_types_from_msg(definition, kind))
    decode = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
    return lambda data: decode(data, kind)
