"""Bags of ROS 1 that hold a raw capture."""

from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore


def write_bag(path: Path, content: bytes, count: int, *, compressed: bool = False) -> None:
    """Write a capture in so many messages, beside a topic of another kind."""
    store = get_typestore(Stores.ROS1_NOETIC)
    array = store.types["std_msgs/msg/Int16MultiArray"]
    layout = store.types["std_msgs/msg/MultiArrayLayout"]
    text = store.types["std_msgs/msg/String"]
    writer = Writer(path)
    if compressed:
        writer.set_compression(Writer.CompressionFormat.BZ2)
    with writer:
        adc = writer.add_connection("/radar/adc", array.__msgtype__, typestore=store)
        log = writer.add_connection("/log", text.__msgtype__, typestore=store)
        words = np.frombuffer(content, "<i2")
        for number, part in enumerate(np.split(words, count)):
            message = array(layout=layout(dim=[], data_offset=0), data=part)
            writer.write(adc, number, store.serialize_ros1(message, array.__msgtype__))
            other = text(data="a message")
            writer.write(log, number, store.serialize_ros1(other, text.__msgtype__))
