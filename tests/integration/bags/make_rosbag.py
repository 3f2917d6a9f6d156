#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes a bag of ROS 1 of what make_frames.py made, by python3-rosbag.

    make_rosbag.py FRAMES OUT.bag none|bz2|lz4 [realsense]

realsense: the topics of RealSense's recorder, depth in units of 0.2 mm where it is mono16, how the cameras sit in /tf/0.
"""
import json
import sys
from pathlib import Path

import genpy
import rosbag
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage


def header_of(message, fields, frame):
    message.header.stamp = genpy.Time(fields["sec"], fields["nanosec"])
    message.header.frame_id = frame
    return message


def main():
    folder, out, compression = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    realsense = "realsense" in sys.argv[4:]
    frames = json.loads((folder / "frames.json").read_text())
    moved = frames["color_from_depth"]
    if realsense:
        base = {"color": "/device_0/sensor_1/Color_0", "depth": "/device_0/sensor_0/Depth_0"}
        names = {what: (f"{b}/image/data", f"{b}/info/camera_info") for what, b in base.items()}
        frame = {"color": "2", "depth": "0"}
    else:
        depth = "/camera/depth" if moved else "/camera/depth_registered"
        names = {"color": ("/camera/rgb/image_color", "/camera/rgb/camera_info"),
                 "depth": (f"{depth}/image", f"{depth}/camera_info")}
        frame = {"color": "/rgb_frame", "depth": "/depth_frame" if moved else "/rgb_frame"}

    with rosbag.Bag(out, "w", compression=compression) as bag:
        start = genpy.Time(frames["messages"][0]["sec"], frames["messages"][0]["nanosec"])
        motion = None
        if moved:
            motion = Transform(Vector3(moved["x"], moved["y"], moved["z"]),
                               Quaternion(moved["qx"], moved["qy"], moved["qz"], moved["qw"]))
        if realsense:
            # The recorder writes stream_from_reference; depth is the reference.
            bag.write("/device_0/sensor_0/Depth_0/tf/0", Transform(rotation=Quaternion(0, 0, 0, 1)), start)
            bag.write("/device_0/sensor_1/Color_0/tf/0", motion or Transform(rotation=Quaternion(0, 0, 0, 1)), start)
            bag.write("/device_0/sensor_0/option/Depth_Units/value", Float32(0.001), start)
        elif moved:
            stamped = TransformStamped(child_frame_id=frame["depth"], transform=motion)
            stamped.header.frame_id = frame["color"]
            bag.write("/tf_static", TFMessage([stamped]), start)
        for fields in frames["messages"]:
            what = fields["what"]
            data = (folder / fields["data"]).read_bytes()
            when = genpy.Time(fields["sec"], fields["nanosec"]) + genpy.Duration(0, 4000000)
            topic, info_topic = names[what]
            if fields["type"] == "Image":
                message = Image(height=fields["height"], width=fields["width"], encoding=fields["encoding"],
                                step=fields["step"], data=data)
            else:
                message = CompressedImage(format=fields["format"], data=data)
                topic += "/compressedDepth" if "compressedDepth" in fields["format"] else "/compressed"
            bag.write(topic, header_of(message, fields, frame[what]), when)
            info = CameraInfo(height=frames["height"], width=frames["width"],
                              distortion_model="Brown Conrady" if realsense else "plumb_bob", D=frames["d"],
                              K=frames["k"], R=[1, 0, 0, 0, 1, 0, 0, 0, 1],
                              P=[frames["k"][0], 0, frames["k"][2], 0, 0, frames["k"][4], frames["k"][5], 0, 0, 0, 1, 0],
                              binning_x=frames.get("binning", 0), binning_y=frames.get("binning", 0),
                              roi=RegionOfInterest(**frames.get("roi", {})))
            bag.write(info_topic, header_of(info, fields, frame[what]), when)


main()
