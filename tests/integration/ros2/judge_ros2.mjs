// SPDX-License-Identifier: BSD-3-Clause
// Listens to what a run publishes, with an implementation of ROS 2's network that others wrote (@foxglove/ros2), decodes
// it with theirs, and tells what came: node judge_ros2.mjs DOMAIN PREFIX [SECONDS [ROBOT [map|pose]]].
// JUDGES: their node_modules.
import { createRequire } from "node:module";

const require = createRequire(process.env.JUDGES + "/");
const { RosNode } = require("@foxglove/ros2");
const { UdpSocketNode, getNetworkInterfaces } = require("@foxglove/ros2/nodejs");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");

const [domain, prefix, seconds] = [Number(process.argv[2]), process.argv[3], Number(process.argv[4] ?? 60)];
const robot = process.argv[5] ?? prefix; // whose path and points are listened to
const last = process.argv[6] ?? "map"; // after two seconds without it the run is over

const header = "std_msgs/Header header\n";
const separator = "================================================================================\nMSG: ";
const parts =
  separator + "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" +
  separator + "builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" +
  separator + "geometry_msgs/PoseStamped\nstd_msgs/Header header\ngeometry_msgs/Pose pose\n" +
  separator + "geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n" +
  separator + "geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" +
  separator + "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" +
  separator + "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n" +
  separator + "geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n" +
  separator + "geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n" +
  separator + "sensor_msgs/PointField\nuint8 INT8=1\nuint8 FLOAT32=7\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n";
const definitions = {
  "nav_msgs/msg/Path": header + "geometry_msgs/PoseStamped[] poses\n" + parts,
  "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n" + parts,
  "geometry_msgs/msg/PoseWithCovarianceStamped":
    header + "geometry_msgs/PoseWithCovariance pose\n" + parts +
    separator + "geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n",
  "sensor_msgs/msg/PointCloud2":
    header + "uint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\nuint32 point_step\n" +
    "uint32 row_step\nuint8[] data\nbool is_dense\n" + parts,
};

const told = {
  tf: { messages: 0, chains: {} },
  path: { messages: 0, poses: 0, frame: "", last: null },
  points: { messages: 0, points: 0, frame: "" },
  pose: { messages: 0, frame: "", last: null, covariance: [] },
  map: { messages: 0, points: 0, bytes: 0, frame: "", fields: [], low: null, high: null },
};

function take(name, message) {
  const into = told[name];
  into.messages += 1;
  if (name === "tf") {
    for (const t of message.transforms) into.chains[`${t.header.frame_id} -> ${t.child_frame_id}`] = t.transform.translation;
    return;
  }
  into.frame = message.header.frame_id;
  if (name === "path") {
    into.poses = message.poses.length;
    into.last = message.poses.at(-1)?.pose.position ?? null;
    return;
  }
  if (name === "pose") {
    into.last = message.pose.pose.position;
    into.covariance = Array.from(message.pose.covariance);
    return;
  }
  into.points += message.width * message.height;
  if (name !== "map") return;
  into.bytes = message.data.byteLength;
  into.fields = message.fields.map((field) => `${field.name}@${field.offset}`);
  const view = new DataView(message.data.buffer, message.data.byteOffset, message.data.byteLength);
  into.low = [Infinity, Infinity, Infinity];
  into.high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < message.width; ++i) {
    for (let axis = 0; axis < 3; ++axis) {
      const value = view.getFloat32(i * message.point_step + 4 * axis, true);
      into.low[axis] = Math.min(into.low[axis], value);
      into.high[axis] = Math.max(into.high[axis], value);
    }
  }
}

const ros = new RosNode({
  name: "judge",
  getNetworkInterfaces,
  domainId: domain,
  udpSocketCreate: UdpSocketNode.Create,
  log: process.env.VERBOSE ? console : undefined,
});
await ros.start();

let quiet;
const end = () => {
  console.log(JSON.stringify(told));
  process.exit(told[last].messages > 0 ? 0 : 1);
};
const topics = [
  ["tf", "/tf", "tf2_msgs/msg/TFMessage"],
  ["path", `/${robot}/path`, "nav_msgs/msg/Path"],
  ["points", `/${robot}/points`, "sensor_msgs/msg/PointCloud2"],
  ["map", `/${prefix}/map`, "sensor_msgs/msg/PointCloud2"],
  ["pose", `/${prefix}/pose`, "geometry_msgs/msg/PoseWithCovarianceStamped"],
];
for (const [name, topic, dataType] of topics) {
  const msgDefinition = parse(definitions[dataType], { ros2: true });
  const reader = new MessageReader(msgDefinition);
  const subscription = ros.subscribe({ topic, dataType, msgDefinition, skipParsing: true });
  subscription.on("message", (_stamp, _message, data) => {
    take(name, reader.readMessage(data));
    if (told[last].messages > 0) {
      clearTimeout(quiet);
      quiet = setTimeout(end, 2000);
    }
  });
}
console.error("listening");
setTimeout(end, seconds * 1000);
