// SPDX-License-Identifier: BSD-3-Clause
// Writes an MCAP file of what make_frames.py made, by @mcap/core and @foxglove's serialization.
//   make_mcap.mjs FRAMES OUT.mcap none|zstd|lz4 cdr|ros1 [option...]
// options: unfinished (no summary, no end), noindex, chunk=BYTES, nochunks
// OUT.cdr instead of OUT.mcap: all messages one after another for make_db3.py.
import { spawnSync } from "node:child_process";
import { createRequire } from "node:module";
import fs from "node:fs";
import path from "node:path";

const require = createRequire(path.join(process.env.PLUMBLINE_JUDGES, "package.json"));
const { McapWriter } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageWriter: Ros2Writer } = require("@foxglove/rosmsg2-serialization");

const [folder, out, compression, encoding, ...options] = process.argv.slice(2);
const frames = JSON.parse(fs.readFileSync(path.join(folder, "frames.json")));

const line = "=".repeat(80) + "\nMSG: ";
const time = line + "builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const header = line + "std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + time;
const definitions = {
  "sensor_msgs/msg/Image":
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n" + header,
  "sensor_msgs/msg/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data\n" + header,
  "sensor_msgs/msg/CameraInfo":
    "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\n" +
    "float64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n" +
    line + "sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n" + header,
  "tf2_msgs/msg/TFMessage":
    "geometry_msgs/TransformStamped[] transforms\n" +
    line + "geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n" +
    line + "geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n" +
    line + "geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n" +
    line + "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n" + header,
};
const writers = Object.fromEntries(
  Object.entries(definitions).map(([type, text]) => [type, new Ros2Writer(parse(text, { ros2: true }))]),
);

const unaligned = frames.color_from_depth !== null;
const frame = { color: "camera_color_optical_frame", depth: unaligned ? "camera_depth_optical_frame" : "camera_color_optical_frame" };
const base = { color: "/camera/color/image_raw", depth: unaligned ? "/camera/depth/image_rect_raw" : "/camera/aligned_depth_to_color/image_raw" };
const parent = (name) => name.slice(0, name.lastIndexOf("/"));

function* all() {
  if (unaligned) {
    const t = frames.color_from_depth;
    yield ["/tf_static", "tf2_msgs/msg/TFMessage", frames.messages[0], {
      transforms: [{
        header: { stamp: { sec: 0, nanosec: 0 }, frame_id: frame.color }, child_frame_id: frame.depth,
        transform: { translation: { x: t.x, y: t.y, z: t.z }, rotation: { x: t.qx, y: t.qy, z: t.qz, w: t.qw } },
      }],
    }];
  }
  for (const message of frames.messages) {
    const stamped = { stamp: { sec: message.sec, nanosec: message.nanosec }, frame_id: frame[message.what] };
    const data = fs.readFileSync(path.join(folder, message.data));
    const topic = base[message.what] +
      (message.type === "Image" ? "" : message.format.includes("compressedDepth") ? "/compressedDepth" : "/compressed");
    yield [topic, `sensor_msgs/msg/${message.type}`, message, message.type === "Image"
      ? { header: stamped, height: message.height, width: message.width, encoding: message.encoding, is_bigendian: 0, step: message.step, data }
      : { header: stamped, format: message.format, data }];
    yield [parent(base[message.what]) + "/camera_info", "sensor_msgs/msg/CameraInfo", message, {
      header: stamped, height: frames.height, width: frames.width, distortion_model: "plumb_bob", d: frames.d, k: frames.k,
      r: [1, 0, 0, 0, 1, 0, 0, 0, 1],
      p: [frames.k[0], 0, frames.k[2], 0, 0, frames.k[4], frames.k[5], 0, 0, 0, 1, 0],
      binning_x: frames.binning ?? 0, binning_y: frames.binning ?? 0,
      roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false, ...frames.roi },
    }];
  }
}

if (out.endsWith(".cdr")) {
  const file = fs.openSync(out, "w");
  for (const [topic, type, message, value] of all()) {
    const data = writers[type].writeMessage(value);
    const head = JSON.stringify({ topic, type, time: `${message.sec}${String(message.nanosec).padStart(9, "0")}`, size: data.byteLength });
    fs.writeSync(file, head + "\n");
    fs.writeSync(file, data);
  }
  fs.closeSync(file);
} else {
  const file = fs.openSync(out, "w");
  let position = 0n;
  const writable = {
    async write(buffer) { fs.writeSync(file, buffer); position += BigInt(buffer.byteLength); },
    position: () => position,
  };
  const pack = (program) => (data) => ({
    compression: program,
    compressedData: spawnSync(program, ["-q", "-c"], { input: data, maxBuffer: 1 << 30 }).stdout,
  });
  const chunk = options.find((o) => o.startsWith("chunk="));
  const writer = new McapWriter({
    writable, useChunks: !options.includes("nochunks"), useChunkIndex: !options.includes("noindex"),
    useMessageIndex: !options.includes("noindex"), chunkSize: chunk ? Number(chunk.slice(6)) : undefined,
    compressChunk: compression === "none" ? undefined : pack(compression),
  });
  await writer.start({ profile: "ros2", library: "make_mcap.mjs" });
  const schemas = new Map(), channels = new Map();
  for (const [topic, type, message, value] of all()) {
    if (!schemas.has(type)) {
      schemas.set(type, await writer.registerSchema({ name: type, encoding: "ros2msg", data: new TextEncoder().encode(definitions[type]) }));
    }
    if (!channels.has(topic)) {
      channels.set(topic, await writer.registerChannel({ schemaId: schemas.get(type), topic, messageEncoding: encoding, metadata: new Map() }));
    }
    const logTime = BigInt(message.sec) * 1000000000n + BigInt(message.nanosec) + 3000000n;
    await writer.addMessage({ channelId: channels.get(topic), sequence: 0, logTime, publishTime: logTime, data: writers[type].writeMessage(value) });
  }
  if (!options.includes("unfinished")) await writer.end();
  fs.closeSync(file);
}
