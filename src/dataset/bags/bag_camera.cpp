// SPDX-License-Identifier: BSD-3-Clause
#include "bags/bag_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "bags/images.hpp"

namespace plumbline::dataset {
namespace {

using geometry::Rigid3;

constexpr double kMillimetres = 1000.0;  // units per metre of ROS' 16-bit depth
constexpr double kNothing = 1e-9;        // rounding error of a transform through quaternions
const char* const kRealSenseImage = "/image/data";

/// Frame name without the leading slash of ROS 1.
std::string frame_name(const std::string& frame) {
  return !frame.empty() && frame.front() == '/' ? frame.substr(1) : frame;
}

struct InfoCamera {
  sensor::Pinhole pinhole;
  sensor::Lens lens;
  std::string frame;
};

/// The lens of a CameraInfo, or what is wrong with it.
tl::expected<sensor::Lens, std::string> lens_of(const CameraInfoMessage& info) {
  sensor::Lens lens;
  const std::string& model = info.distortion_model;
  const bool none = std::all_of(info.d.begin(), info.d.end(), [](double k) { return k == 0.0; });
  const bool fisheye = model == "equidistant" || model == "fisheye";
  if (none && !fisheye) return lens;

  if (fisheye) {
    lens.model = sensor::LensModel::kEquidistant;
  } else if (model != "plumb_bob" && model != "rational_polynomial" &&
             model.find("rown") == std::string::npos && !model.empty()) {
    return tl::unexpected(fmt::format(
        "has the distortion model '{}' (known: plumb_bob, rational_polynomial, equidistant)", model));
  }

  const std::size_t most = fisheye ? 4 : lens.k.size();
  // OpenCV's models of 12 and 14 coefficients have further ones that are nearly always 0.
  for (std::size_t i = 0; i < info.d.size(); ++i) {
    if (!std::isfinite(info.d[i]) || (i >= most && info.d[i] != 0.0))
      return tl::unexpected(
          fmt::format("has {} coefficients of distortion ({} are read)", info.d.size(), most));
    if (i < most) lens.k[i] = info.d[i];
  }

  return lens;
}

/// The camera of a message: of the full image, and of the images that it accompanies.
struct InfoPinholes {
  sensor::Pinhole full;
  sensor::Pinhole image;
  [[nodiscard]] bool differ() const { return full.width != image.width || full.height != image.height; }
};

/// Size and offset along one axis of the image that is made of the full one.
struct InfoAxis {
  std::uint32_t full = 0;
  std::uint32_t offset = 0;
  std::uint32_t region = 0;   ///< 0: up to the edge
  std::uint32_t binning = 1;  ///< 0 means 1
};

/// The axis with its defaults (0) filled in; none if the region does not fit into the full image.
std::optional<InfoAxis> complete_axis(InfoAxis axis) {
  if (axis.offset >= axis.full) return std::nullopt;
  if (axis.region == 0) axis.region = axis.full - axis.offset;
  if (axis.binning == 0) axis.binning = 1;
  if (axis.region > axis.full - axis.offset || axis.binning > axis.region) return std::nullopt;
  return axis;
}

/// REP 104: the region of interest is cut out of the full image, and its pixels are binned. A pixel's
/// middle is at whole numbers here, so that binned pixel 0 of two has its middle at 0.5 of the unbinned ones.
tl::expected<InfoPinholes, std::string> pinholes_of(const CameraInfoMessage& info, bool by_p) {
  const auto size_ok = [](std::uint32_t size) { return size > 0 && size <= 32768; };
  if (!size_ok(info.width) || !size_ok(info.height))
    return tl::unexpected(fmt::format("says {} x {} pixels", info.width, info.height));

  // Binning and region shrink the stored image
  const RegionMessage& roi = info.roi;
  const auto x = complete_axis({info.width, roi.x_offset, roi.width, info.binning_x});
  const auto y = complete_axis({info.height, roi.y_offset, roi.height, info.binning_y});
  if (!x || !y) {
    return tl::unexpected(
        fmt::format("has a region of interest of {} x {} pixels at {}, {} with a binning of {} x {}, which "
                    "does not fit in its {} x {} pixels",
                    roi.width, roi.height, roi.x_offset, roi.y_offset, info.binning_x, info.binning_y,
                    info.width, info.height));
  }

  // P belongs to rectified images, K to raw ones
  const double fx = by_p ? info.p[0] : info.k[0];
  const double fy = by_p ? info.p[5] : info.k[4];
  const double cx = by_p ? info.p[2] : info.k[2];
  const double cy = by_p ? info.p[6] : info.k[5];

  // A binned pixel is centred between its originals
  const auto pixels = [](std::uint32_t size) { return static_cast<int>(size); };
  const auto middle = [](double c, const InfoAxis& axis) {
    return axis.binning == 1 ? c - axis.offset : (c - axis.offset + 0.5) / axis.binning - 0.5;
  };
  return InfoPinholes{{pixels(info.width), pixels(info.height), fx, fy, cx, cy},
                      {pixels(x->region / x->binning), pixels(y->region / y->binning), fx / x->binning,
                       fy / y->binning, middle(cx, *x), middle(cy, *y)}};
}

/// Size of a topic's first image; none if that cannot be read.
std::optional<cv::Size> image_size(const BagSurvey& survey, const SurveyedTopic& topic) {
  if (topic.images.empty()) return std::nullopt;
  const MessagePlace& place = topic.images.front().place;
  MessageImage image = tl::unexpected<std::string>("");
  if (topic.is("sensor_msgs/Image")) {
    if (const auto raw = survey.read(topic, place, &MessageDecoder::image)) image = image_of(*raw);
  } else if (const auto file = survey.read(topic, place, &MessageDecoder::compressed_image)) {
    image = image_of(*file);
  }
  return image ? std::optional(image->size()) : std::nullopt;
}

/// The camera of CameraInfo for the images of a topic; none, with a warning, where it was never calibrated.
core::Result<std::optional<InfoCamera>> read_info(const BagSurvey& survey, const ChosenTopic& info,
                                                  const SurveyedTopic& images, core::Log& log) {
  if (info.topic == nullptr) return std::nullopt;
  const auto message = survey.first(*info.topic, &MessageDecoder::camera_info);
  if (!message) return tl::unexpected(message.error());

  // An image that has been undistorted has the camera of P.
  const bool rectified = images.topic.name.find("image_rect") != std::string::npos;
  const bool by_p = rectified && message->p[0] != 0.0;
  const std::string place = fmt::format("{}: {}", survey.path, info.topic->topic.name);
  if ((by_p ? message->p[0] : message->k[0]) == 0.0) {
    log.warning(
        fmt::format("{}: is there, but its K is zero: the camera was never calibrated; name a camera "
                    "file with --camera",
                    place));
    return std::nullopt;
  }

  const auto wrong = [&place](const std::string& what) {
    return core::input_error(fmt::format("{} {}; name a camera file with --camera", place, what));
  };

  // Regions and binning, where the images have them.
  const auto pinholes = pinholes_of(*message, by_p);
  if (!pinholes) return wrong(pinholes.error());
  InfoCamera camera{pinholes->image, {}, frame_name(message->header.frame_id)};

  // Some drivers announce a region but send full images
  if (pinholes->differ()) {
    const cv::Size full(pinholes->full.width, pinholes->full.height);
    if (image_size(survey, images) == full) {
      camera.pinhole = pinholes->full;
      log.warning(
          fmt::format("{}: says that only a part of the picture is sent, or that it is binned, but the "
                      "images have the full size of {} x {}; they are taken for the full picture",
                      place, full.width, full.height));
    }
  }

  // Rectified images have no distortion
  if (rectified) return camera;
  const auto lens = lens_of(*message);
  if (!lens) return wrong(lens.error());
  camera.lens = *lens;
  return camera;
}

/// Frames with their poses in the parent frames.
class Transforms {
 public:
  void add(const std::vector<TransformMessage>& transforms) {
    for (const TransformMessage& t : transforms)
      parents_.try_emplace(frame_name(t.child), frame_name(t.parent), t.parent_from_child);
  }
  /// Transform between two frames; none if they are not connected.
  [[nodiscard]] std::optional<Rigid3> between(const std::string& target, const std::string& source) const {
    const auto target_path = to_root(target);
    const auto source_path = to_root(source);
    for (const auto& [frame, frame_from_source] : source_path) {
      for (const auto& [other, frame_from_target] : target_path) {
        if (frame == other) return frame_from_target.inverse() * frame_from_source;
      }
    }
    return std::nullopt;
  }

 private:
  using Step = std::pair<std::string, Rigid3>;

  /// The frame itself and all above it, each with frame_from_start.
  [[nodiscard]] std::vector<Step> to_root(const std::string& start) const {
    std::vector<Step> path{{start, Rigid3()}};
    while (path.size() <= parents_.size()) {
      const auto parent = parents_.find(path.back().first);
      if (parent == parents_.end()) break;
      path.emplace_back(parent->second.first, parent->second.second * path.back().second);
    }
    return path;
  }

  std::map<std::string, std::pair<std::string, Rigid3>> parents_;
};

/// The transforms in the first messages of both topics of ROS.
Transforms read_all_transforms(const BagSurvey& survey) {
  Transforms transforms;
  for (const char* name : {"/tf_static", "/tf"}) {  // ROS 1's publishers of fixed frames use /tf
    const SurveyedTopic* topic = survey.find(name);
    if (topic == nullptr || topic->decoder == nullptr) continue;
    const std::size_t count = std::min(topic->others.size(), kFewMessages);
    for (std::size_t i = 0; i < count; ++i) {
      if (const auto message = survey.read(*topic, topic->others[i], &MessageDecoder::transforms))
        transforms.add(*message);
    }
  }
  return transforms;
}

/// Base name of the topics that RealSense's recorder writes for an image topic:
/// "/device_0/sensor_0/Depth_0" for ".../image/data".
std::string realsense_stream(const std::string& image) {
  const std::size_t at = image.find(kRealSenseImage);
  return image.rfind("/device_", 0) == 0 && at != std::string::npos ? image.substr(0, at) : "";
}

/// stream_from_reference, of ".../tf/0".
std::optional<Rigid3> realsense_transform(const BagSurvey& survey, const std::string& stream) {
  for (const SurveyedTopic& topic : survey.topics) {
    if (topic.topic.name.rfind(stream + "/tf/", 0) != 0 || topic.others.empty()) continue;
    if (const auto motion = survey.first(topic, &MessageDecoder::transform)) return *motion;
  }
  return std::nullopt;
}

/// Metres a unit, of the sensor's ".../option/Depth_Units/value".
double realsense_depth_scale(const BagSurvey& survey, const std::string& stream) {
  const std::string sensor = stream.substr(0, stream.rfind('/'));
  for (const SurveyedTopic& topic : survey.topics) {
    const bool units = topic.topic.name == sensor + "/option/Depth_Units/value" ||
                       topic.topic.name == sensor + "/option/Depth Units/value";
    if (!units || topic.others.empty()) continue;
    const auto metres = survey.first(topic, &MessageDecoder::number);
    if (!metres || !(*metres > 1e-7F && *metres < 1.0F)) continue;
    // Rounded, because 0.001 as a float is not exactly 1 / 1000
    return std::round(100.0 / static_cast<double>(*metres)) / 100.0;
  }
  return kMillimetres;
}

std::optional<Rigid3> color_from_depth(const BagSurvey& survey, const ChosenTopics& topics,
                                       const InfoCamera& color, const InfoCamera& depth) {
  // RealSense's own bags have no /tf_static
  const std::string color_stream = realsense_stream(topics.color.topic->topic.name);
  const std::string depth_stream = realsense_stream(topics.depth.topic->topic.name);
  if (!color_stream.empty() && !depth_stream.empty()) {
    const auto color_from_reference = realsense_transform(survey, color_stream);
    const auto depth_from_reference = realsense_transform(survey, depth_stream);
    if (color_from_reference && depth_from_reference)
      return *color_from_reference * depth_from_reference->inverse();
  }

  // Images of one frame need no transform
  if (!color.frame.empty() && color.frame == depth.frame) return Rigid3();
  return read_all_transforms(survey).between(color.frame, depth.frame);
}

bool same_pixels(const sensor::Pinhole& a, const sensor::Pinhole& b) {
  return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy && a.cx == b.cx &&
         a.cy == b.cy;
}

/// Adds a depth camera if depth is not registered to colour.
core::Result<void> add_depth_camera(const BagSurvey& survey, const ChosenTopics& topics,
                                    const InfoCamera& color, const InfoCamera& depth,
                                    sensor::CameraReading& reading) {
  const std::string& depth_name = topics.depth.topic->topic.name;
  const bool same = same_pixels(color.pinhole, depth.pinhole);
  const bool by_name = depth_name.find("aligned_depth") != std::string::npos ||
                       depth_name.find("registered") != std::string::npos;
  if (same && (by_name || color.frame == depth.frame)) return {};

  // Depth of another camera needs the transform
  const auto motion = color_from_depth(survey, topics, color, depth);
  if (!motion) {
    return core::usage_error(
        fmt::format("{}: {} (frame '{}') and {} (frame '{}') are of different cameras, and no transform in "
                    "/tf_static says how these sit; take a depth image that is aligned to colour with "
                    "--topic depth=, or name a camera file with color_from_depth with --camera",
                    survey.path, topics.color.topic->topic.name, color.frame, depth_name, depth.frame));
  }

  // Equal cameras in one place are registered
  const bool nothing_moves = motion->rotation.isIdentity(kNothing) && motion->translation.isZero(kNothing);
  if (same && nothing_moves) return {};
  reading.camera.color_from_depth = *motion;
  reading.camera.depth = depth.pinhole;
  reading.camera.depth_lens = depth.lens;
  reading.notes.push_back("depth from " + topics.depth_info.topic->topic.name + ", brought into colour");
  return {};
}

}  // namespace

core::Result<std::optional<sensor::CameraReading>> bag_camera(const BagSurvey& survey,
                                                              const ChosenTopics& topics, core::Log& log) {
  if (topics.info.topic == nullptr)
    log.warning(fmt::format("{}: has no CameraInfo for {}", survey.path, topics.color.topic->topic.name));
  const auto color = read_info(survey, topics.info, *topics.color.topic, log);
  if (!color) return tl::unexpected(color.error());
  if (!*color) return std::nullopt;

  // Intrinsics and distortion of the colour camera
  sensor::CameraReading reading;
  reading.program = "ROS";
  reading.camera.name = topics.info.topic->topic.name;
  reading.camera.color = (*color)->pinhole;
  reading.camera.model = (*color)->lens.model;
  reading.camera.distortion = (*color)->lens.k;
  reading.camera.depth_scale = kMillimetres;

  // RealSense's own bags name the depth unit
  const std::string stream = realsense_stream(topics.depth.topic->topic.name);
  if (!stream.empty()) reading.camera.depth_scale = realsense_depth_scale(survey, stream);

  // Depth may come from a second camera
  const auto depth = read_info(survey, topics.depth_info, *topics.depth.topic, log);
  if (!depth) return tl::unexpected(depth.error());
  if (*depth) {
    if (auto added = add_depth_camera(survey, topics, **color, **depth, reading); !added)
      return tl::unexpected(added.error());
  }

  // An uncalibrated camera is reported, not used
  if (const std::string wrong = sensor::camera_problem(reading.camera); !wrong.empty()) {
    return core::input_error(fmt::format("{}: {}: {}; name a camera file with --camera", survey.path,
                                         topics.info.topic->topic.name, wrong));
  }

  return reading;
}

std::optional<Rigid3> body_from_camera(const BagSurvey& survey, const ChosenTopics& topics,
                                       const std::string& body) {
  if (topics.info.topic == nullptr || body.empty()) return std::nullopt;
  const auto info = survey.first(*topics.info.topic, &MessageDecoder::camera_info);
  if (!info) return std::nullopt;
  return read_all_transforms(survey).between(frame_name(body), frame_name(info->header.frame_id));
}

}  // namespace plumbline::dataset
