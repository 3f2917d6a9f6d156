// SPDX-License-Identifier: BSD-3-Clause
#include "images/azure_kinect.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "plumbline/core/json.hpp"

namespace plumbline::dataset {
namespace {

using json = nlohmann::ordered_json;

/// Crop of the whole sensor in one depth mode: the sensor's size in pixels of the mode, and the origin of the
/// image in it.
struct AzureMode {
  const char* name;
  int sensor_width;
  int sensor_height;
  int crop_x;
  int crop_y;
  int width;
  int height;
};

constexpr std::array<AzureMode, 4> kDepthModes = {{{"NFOV_2X2BINNED", 512, 512, 96, 90, 320, 288},
                                                   {"NFOV_UNBINNED", 1024, 1024, 192, 180, 640, 576},
                                                   {"WFOV_2X2BINNED", 512, 512, 0, 0, 512, 512},
                                                   {"WFOV_UNBINNED", 1024, 1024, 0, 0, 1024, 1024}}};
constexpr std::array<AzureMode, 6> kColorModes = {{{"720P", 1280, 960, 0, 120, 1280, 720},
                                                   {"1080P", 1920, 1440, 0, 180, 1920, 1080},
                                                   {"1440P", 2560, 1920, 0, 240, 2560, 1440},
                                                   {"1536P", 2048, 1536, 0, 0, 2048, 1536},
                                                   {"2160P", 3840, 2880, 0, 360, 3840, 2160},
                                                   {"3072P", 4096, 3072, 0, 0, 4096, 3072}}};

const AzureMode* depth_mode_of(const std::string& name) {
  const auto found = std::find_if(kDepthModes.begin(), kDepthModes.end(),
                                  [&](const AzureMode& m) { return name == m.name; });
  return found == kDepthModes.end() ? nullptr : &*found;
}

const AzureMode* color_mode_of(int height) {
  const auto found = std::find_if(kColorModes.begin(), kColorModes.end(),
                                  [&](const AzureMode& m) { return height == m.height; });
  return found == kColorModes.end() ? nullptr : &*found;
}

std::string text_at(const json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// The object with a path of keys; null when there is none.
const json& value_at(const json& object, std::initializer_list<const char*> keys) {
  static const json nothing;
  const json* here = &object;
  for (const char* key : keys) {
    const auto found = here->is_object() ? here->find(key) : here->end();
    if (!here->is_object() || found == here->end()) return nothing;
    here = &*found;
  }
  return *here;
}

/// All numbers of an array of that length; none if one is missing or not finite.
std::optional<std::vector<double>> finite_numbers(const json& array, std::size_t count) {
  if (!array.is_array() || array.size() != count) return std::nullopt;
  std::vector<double> numbers;
  for (const json& item : array) {
    if (!item.is_number() || !std::isfinite(item.get<double>())) return std::nullopt;
    numbers.push_back(item.get<double>());
  }
  return numbers;
}

/// The first camera with that purpose; null if none has it.
const json& camera_for(const json& calibration, const char* purpose) {
  static const json nothing;
  const json& cameras = value_at(calibration, {"CalibrationInformation", "Cameras"});
  if (!cameras.is_array()) return nothing;
  for (const json& camera : cameras) {
    if (text_at(camera, "Purpose").find(purpose) != std::string::npos) return camera;
  }
  return nothing;
}

struct AzureCamera {
  sensor::Pinhole pinhole;
  sensor::Lens lens;
  geometry::Rigid3 from_rig;  ///< camera_from_rig
};

/// The parameters are shares of the sensor's size, with (0, 0) its corner: cx cy fx fy k1 ... k6, centre of
/// distortion, p2 p1.
core::Result<AzureCamera> camera_in_mode(const json& camera, const AzureMode& mode) {
  const std::string model = text_at(value_at(camera, {"Intrinsics"}), "ModelType");
  if (model != "CALIBRATION_LensDistortionModelBrownConrady")
    return core::input_error(
        fmt::format("its calibration has the lens model '{}', which is not known", model));

  // Intrinsics, distortion and pose in the rig
  const auto n = finite_numbers(value_at(camera, {"Intrinsics", "ModelParameters"}), 14);
  const auto r = finite_numbers(value_at(camera, {"Rt", "Rotation"}), 9);
  const auto t = finite_numbers(value_at(camera, {"Rt", "Translation"}), 3);
  if (!n || !r || !t || (*n)[10] != 0.0 || (*n)[11] != 0.0) {
    return core::input_error(
        "its calibration is damaged: 14 parameters, 9 of a rotation and 3 of a translation "
        "are needed, and a centre of distortion of 0");
  }

  // Intrinsics are shares of the sensor's size
  AzureCamera result;
  constexpr double kCentreOfFirstPixel = 0.5;
  result.pinhole = {mode.width,
                    mode.height,
                    (*n)[2] * mode.sensor_width,
                    (*n)[3] * mode.sensor_height,
                    (*n)[0] * mode.sensor_width - mode.crop_x - kCentreOfFirstPixel,
                    (*n)[1] * mode.sensor_height - mode.crop_y - kCentreOfFirstPixel};

  // OpenCV's order of the coefficients
  const std::vector<double>& k = *n;
  result.lens.k = {k[4], k[5], k[13], k[12], k[6], k[7], k[8], k[9]};
  const Eigen::Matrix3d rotation = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r->data());
  const double bent = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(bent < 1e-3) || rotation.determinant() < 0.0)
    return core::input_error("its calibration is damaged: Rt is not a rotation");

  result.from_rig =
      geometry::Rigid3(Eigen::Quaterniond(rotation), Eigen::Vector3d((*t)[0], (*t)[1], (*t)[2]));
  return result;
}

template <std::size_t kCount>
std::string mode_names(const std::array<AzureMode, kCount>& modes) {
  std::string names;
  for (const AzureMode& mode : modes) names += (names.empty() ? "" : ", ") + std::string(mode.name);
  return names;
}

std::string tag_of(const ContainerTrack& track, const std::string& key) {
  const auto found = track.tags.find(key);
  return found == track.tags.end() ? "" : found->second;
}

/// 16 bits, the high byte first, to CV_16UC1.
cv::Mat decode_b16g(const Bytes& bytes, int width, int height) {
  if (bytes.size() != 2 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) return {};
  cv::Mat image(height, width, CV_16UC1);
  auto* to = image.ptr<std::uint16_t>();
  for (std::size_t i = 0; i < image.total(); ++i)
    to[i] = static_cast<std::uint16_t>((bytes[2 * i] << 8) | bytes[2 * i + 1]);
  return image;
}

/// NV12, YUY2 and BGRA to BGR; empty when the format is another or the packet of another size.
cv::Mat decode_raw_color(const ContainerTrack& track, Bytes& bytes) {
  const auto pixels = static_cast<std::size_t>(track.width) * static_cast<std::size_t>(track.height);
  cv::Mat bgr;
  if (track.fourcc == "NV12" && bytes.size() == pixels * 3 / 2) {
    cv::cvtColor(cv::Mat(track.height * 3 / 2, track.width, CV_8UC1, bytes.data()), bgr,
                 cv::COLOR_YUV2BGR_NV12);
  } else if (track.fourcc == "YUY2" && bytes.size() == pixels * 2) {
    cv::cvtColor(cv::Mat(track.height, track.width, CV_8UC2, bytes.data()), bgr, cv::COLOR_YUV2BGR_YUY2);
  } else if (track.fourcc == "BGRA" && bytes.size() == pixels * 4) {
    cv::cvtColor(cv::Mat(track.height, track.width, CV_8UC4, bytes.data()), bgr, cv::COLOR_BGRA2BGR);
  }
  return bgr;
}

bool is_color_format(const ContainerTrack& track) {
  return track.codec == "mjpeg" ||
         (track.codec == "rawvideo" &&
          (track.fourcc == "NV12" || track.fourcc == "YUY2" || track.fourcc == "BGRA"));
}

}  // namespace

std::optional<std::pair<int, int>> azure_depth_size(const std::string& depth_mode) {
  const AzureMode* mode = depth_mode_of(depth_mode);
  return mode == nullptr ? std::nullopt : std::optional(std::pair(mode->width, mode->height));
}

core::Result<sensor::Camera> azure_kinect_camera(const std::string& calibration,
                                                 const std::string& depth_mode, int color_height) {
  // The modes tell size and cropping of images
  const AzureMode* depth = depth_mode_of(depth_mode);
  const AzureMode* color = color_mode_of(color_height);
  if (depth == nullptr) {
    return core::input_error(
        fmt::format("its depth mode '{}' is not known (known: {})", depth_mode, mode_names(kDepthModes)));
  }

  if (color == nullptr) {
    return core::input_error(
        fmt::format("colour images {} pixels high are of no mode that is known (known: {})", color_height,
                    mode_names(kColorModes)));
  }

  // The calibration holds both cameras
  const auto parsed = core::parse_json(calibration, "calibration.json");
  if (!parsed) return tl::unexpected(parsed.error());
  const auto depth_camera = camera_in_mode(camera_for(*parsed, "PurposeDepth"), *depth);
  if (!depth_camera) return tl::unexpected(depth_camera.error());

  const auto color_camera = camera_in_mode(camera_for(*parsed, "PurposePhotoVideo"), *color);
  if (!color_camera) return tl::unexpected(color_camera.error());

  // Both poses are relative to the rig
  sensor::Camera camera;
  camera.name = "azure_kinect";
  camera.color = color_camera->pinhole;
  camera.distortion = color_camera->lens.k;
  camera.depth = depth_camera->pinhole;
  camera.depth_lens = depth_camera->lens;
  camera.color_from_depth = color_camera->from_rig * depth_camera->from_rig.inverse();
  camera.depth_scale = 1000.0;
  return camera;
}

core::Result<std::unique_ptr<AzureKinectFile>> AzureKinectFile::open(const std::string& file) {
  const auto& demuxer = core::part<Demuxer>();
  if (!demuxer) return tl::unexpected(demuxer.error());
  std::unique_ptr<AzureKinectFile> opened(new AzureKinectFile(file, **demuxer));
  ContainerContents contents;
  opened->container_ = (*demuxer)->open(file.c_str(), contents);
  if (opened->container_ == nullptr) return core::input_error(file + ": is not a readable Matroska file");

  // Any Matroska film can be opened up to here
  if (auto understood = opened->understand(contents); !understood) {
    return core::input_error(fmt::format("{}: is not an Azure Kinect recording with colour and depth: {}",
                                         file, understood.error().message));
  }
  opened->list_stamps();
  return opened;
}

AzureKinectFile::~AzureKinectFile() {
  if (container_ != nullptr) demuxer_.close(container_);
}

core::Result<void> AzureKinectFile::understand(const ContainerContents& contents) {
  // Tracks are known by title or mode
  for (std::size_t i = 0; i < contents.tracks.size(); ++i) {
    const ContainerTrack& track = contents.tracks[i];
    const std::string title = tag_of(track, "title");
    if (title == "COLOR" || !tag_of(track, "K4A_COLOR_MODE").empty()) color_ = {static_cast<int>(i), track};
    if (title == "DEPTH" || !tag_of(track, "K4A_DEPTH_MODE").empty()) depth_ = {static_cast<int>(i), track};
  }

  // Both tracks must be decodable
  if (color_.number < 0) return core::input_error("it has no track COLOR");
  if (depth_.number < 0) return core::input_error("it has no track DEPTH");
  if (!is_color_format(color_.info)) {
    return core::input_error(fmt::format("colour is stored as {} {} (known: mjpeg, NV12, YUY2, BGRA)",
                                         color_.info.codec, color_.info.fourcc));
  }

  if (depth_.info.codec != "rawvideo" || depth_.info.fourcc != "b16g") {
    return core::input_error(fmt::format("depth is stored as {} {} (known: rawvideo b16g)", depth_.info.codec,
                                         depth_.info.fourcc));
  }

  // The device attaches its factory's calibration
  const auto calibration =
      std::find_if(contents.attachments.begin(), contents.attachments.end(),
                   [](const ContainerAttachment& a) { return a.name == "calibration.json"; });
  if (calibration == contents.attachments.end())
    return core::input_error("it has no attachment calibration.json");

  // The calibration depends on both modes
  color_mode_ = tag_of(color_.info, "K4A_COLOR_MODE");
  depth_mode_ = tag_of(depth_.info, "K4A_DEPTH_MODE");
  auto camera = azure_kinect_camera(std::string(calibration->bytes.begin(), calibration->bytes.end()),
                                    depth_mode_, color_.info.height);
  if (!camera) return tl::unexpected(camera.error());
  camera_ = std::move(*camera);

  // Intrinsics hold only for the modes' sizes
  const bool sizes = camera_.color.width == color_.info.width && camera_.depth->width == depth_.info.width &&
                     camera_.depth->height == depth_.info.height;
  if (!sizes) return core::input_error("its images have other sizes than its modes");

  return {};
}

void AzureKinectFile::list_stamps() {
  ContainerPacket packet;

  // Only the packets hold the stamps
  demuxer_.seek(container_, color_.number, 0);
  while (demuxer_.next(container_, packet, false)) {
    for (Track* track : {&color_, &depth_}) {
      if (packet.track == track->number) track->stamps.push_back(packet.stamp_us);
    }
  }
  for (Track* track : {&color_, &depth_}) std::sort(track->stamps.begin(), track->stamps.end());
}

const ContainerPacket* AzureKinectFile::passed(int track, std::int64_t stamp_us) const {
  const auto found = std::find_if(recent_.begin(), recent_.end(), [&](const ContainerPacket& p) {
    return p.track == track && p.stamp_us == stamp_us;
  });
  return found == recent_.end() ? nullptr : &*found;
}

/// Keeps the last packets: at most 64 and 64 MB, but at least two.
void AzureKinectFile::remember(ContainerPacket packet) {
  constexpr std::size_t kMost = 64;
  constexpr std::size_t kMostBytes = 64'000'000;
  recent_.push_back(std::move(packet));
  std::size_t bytes = 0;
  for (const ContainerPacket& p : recent_) bytes += p.bytes.size();
  while (recent_.size() > 2 && (recent_.size() > kMost || bytes > kMostBytes)) {
    bytes -= recent_.front().bytes.size();
    recent_.pop_front();
  }
}

core::Result<Bytes> AzureKinectFile::packet_of(const Track& track, std::int64_t stamp_us) {
  constexpr std::int64_t kFar_us = 2'000'000;     // beyond, seeking is quicker than reading
  constexpr std::int64_t kBehind_us = 1'000'000;  // tracks are that far apart in the file, at most
  const std::lock_guard lock(mutex_);
  if (const ContainerPacket* known = passed(track.number, stamp_us)) return known->bytes;

  // Steps back and far jumps need a seek
  if (at_us_ < 0 || stamp_us <= at_us_ || stamp_us > at_us_ + kFar_us) {
    recent_.clear();
    if (!demuxer_.seek(container_, track.number, stamp_us))
      return core::input_error(
          fmt::format("{}: {:.6f} s cannot be found", file_, 1e-6 * static_cast<double>(stamp_us)));
  }

  // Packets of the other track are kept, too
  ContainerPacket packet;
  while (demuxer_.next(container_, packet, true)) {
    const bool ours = packet.track == color_.number || packet.track == depth_.number;
    if (!ours) continue;

    // The packet may follow those of the other track
    const bool it = packet.track == track.number && packet.stamp_us == stamp_us;
    const bool past = packet.stamp_us > stamp_us + kBehind_us;
    at_us_ = packet.stamp_us;
    remember(std::move(packet));
    if (it) return recent_.back().bytes;
    if (past) break;
  }

  // After an error the next call seeks
  at_us_ = -1;
  return core::input_error(
      fmt::format("{}: the image at {:.6f} s cannot be read", file_, 1e-6 * static_cast<double>(stamp_us)));
}

core::Result<cv::Mat> AzureKinectFile::read(ImageId id) {
  const Track& track = track_of(id);
  auto bytes = packet_of(track, track.stamps.at(id.number));
  if (!bytes) return tl::unexpected(bytes.error());
  const auto damaged = [&](const std::string& what) {
    return core::input_error(fmt::format("{}: truncated or damaged: {}", describe(id), what));
  };

  // Compressed colour
  if (track.info.codec == "mjpeg") {
    if (!is_jpeg(*bytes)) return damaged("no JPEG");
    Decoded image = decode_jpeg(*bytes);
    if (!image) return damaged(image.error());
    return std::move(*image);
  }

  // Raw pixels of depth or colour
  cv::Mat image = id.list == ImageList::kDepth ? decode_b16g(*bytes, track.info.width, track.info.height)
                                               : decode_raw_color(track.info, *bytes);
  if (image.empty()) return damaged("the packet has another size than the image");
  return image;
}

std::string AzureKinectFile::describe(ImageId id) const {
  return fmt::format("{}#{}@{}", file_, id.list == ImageList::kDepth ? "depth" : "color",
                     track_of(id).stamps.at(id.number));
}

}  // namespace plumbline::dataset
