"""MCAP with ROS 2's messages: the tip's pose, the wrench on the tool, and the depth of the presses.

/tip/pose geometry_msgs/PoseStamped and /tip/wrench geometry_msgs/WrenchStamped, frame `device` (metres,
newtons, right-handed, z up, as REP 103 asks; quaternions x, y, z, w; the axes are the recording's own);
/tip/depth std_msgs/Float64, m. Stamps are the recording's seconds. Foxglove, PlotJuggler and `ros2 bag play`
read such files; `palpate import` reads it back.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from palpate.exporting.recorded import Recorded
from palpate.mechanics.progress import Progress, silent
from palpate.version import __version__

FRAME = "device"
_POSE, _WRENCH, _DEPTH = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/WrenchStamped",
    "std_msgs/msg/Float64",
)
_EVERY = 5000


def write(path: Path, told: Recorded, progress: Progress = silent) -> tuple[str, ...]:
    """Write the file; what it does not say. Raises ImportError where mcap or rosbags is not installed."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    make, recording, depth = _Messages(store.types), told.recording, told.depth_m
    turned = recording.quaternion
    about = {
        "tip_radius_m": f"{recording.tip_radius_m!r}",
        "force_on": "tool",
        "object": recording.object_name,
        "sample_rate_hz": f"{recording.sample_rate_hz!r}",
        "quaternion": "measured" if turned is not None else "not measured: identity",
    }
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library=f"palpate {__version__}")
        channels = {}
        for topic, kind in (("/tip/pose", _POSE), ("/tip/wrench", _WRENCH), ("/tip/depth", _DEPTH)):
            if topic != "/tip/depth" or depth is not None:
                text = store.generate_msgdef(kind, ros_version=2)[0].encode()
                schema = writer.register_schema(kind, "ros2msg", text)
                channels[topic] = writer.register_channel(topic, "cdr", schema), kind
        writer.add_metadata("palpate", about)
        stamps = np.round(1e9 * recording.t).astype(np.int64)
        still = np.array([1.0, 0.0, 0.0, 0.0])
        for k, stamp in enumerate(stamps.tolist()):
            said = {
                "/tip/pose": make.pose(stamp, recording.position[k], still if turned is None else turned[k]),
                "/tip/wrench": make.wrench(stamp, recording.force_on_tool[k]),
            }
            if depth is not None:
                said["/tip/depth"] = make.number(depth[k])
            for topic, message in said.items():
                channel, kind = channels[topic]
                data = bytes(store.serialize_cdr(message, kind))
                writer.add_message(channel, log_time=stamp, data=data, publish_time=stamp)
            if k % _EVERY == 0:
                progress("messages", k / len(stamps))
        writer.finish()
    lost = () if turned is not None else ("orientation was not recorded: the poses have none (identity)",)
    return (
        *lost,
        *told.notes,
        f"the tip's radius is in the metadata 'palpate': {recording.tip_radius_m:g} m",
    )


class _Messages:
    """Makes ROS 2's messages. types: by name."""

    def __init__(self, types: Any) -> None:
        geometry = "geometry_msgs/msg/"
        self._time, self._header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
        self._point, self._vector = types[geometry + "Point"], types[geometry + "Vector3"]
        self._pose, self._wrench = types[geometry + "Pose"], types[geometry + "Wrench"]
        self._quaternion, self._number = types[geometry + "Quaternion"], types[_DEPTH]
        self._posed, self._wrenched = types[_POSE], types[_WRENCH]
        self._none = self._vector(0.0, 0.0, 0.0)

    def _at(self, stamp_ns: int) -> Any:
        return self._header(self._time(*divmod(stamp_ns, 10**9)), FRAME)

    def pose(self, stamp_ns: int, position: np.ndarray, wxyz: np.ndarray) -> Any:
        """position (3,) m, wxyz (4,)."""
        w, x, y, z = wxyz.tolist()
        pose = self._pose(self._point(*position.tolist()), self._quaternion(x, y, z, w))
        return self._posed(self._at(stamp_ns), pose)

    def wrench(self, stamp_ns: int, force: np.ndarray) -> Any:
        """force (3,) N; no torque is known."""
        return self._wrenched(self._at(stamp_ns), self._wrench(self._vector(*force.tolist()), self._none))

    def number(self, value: float) -> Any:
        """One number."""
        return self._number(float(value))
