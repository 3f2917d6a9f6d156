// SPDX-License-Identifier: BSD-3-Clause
#include "images/exr.hpp"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>

#include <array>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>

namespace plumbline::dataset {
namespace {

class MemoryStream : public Imf::IStream {
 public:
  explicit MemoryStream(const Bytes& bytes) : Imf::IStream("memory"), bytes_(bytes) {}

  bool read(char c[], int n) override {
    const auto size = static_cast<std::size_t>(n);
    if (n < 0 || size > bytes_.size() - at_) throw std::runtime_error("the file ends before the image does");
    std::memcpy(c, bytes_.data() + at_, size);
    at_ += size;
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t to) override {
    if (to > bytes_.size()) throw std::runtime_error("the file ends before the image does");
    at_ = static_cast<std::size_t>(to);
  }

 private:
  const Bytes& bytes_;
  std::size_t at_ = 0;
};

/// Name of the channel that holds depth, "" if it is ambiguous.
std::string depth_channel(const Imf::ChannelList& channels) {
  for (const char* name : {"Z", "Y", "R"}) {
    if (channels.findChannel(name) != nullptr) return name;
  }
  const auto first = channels.begin();
  if (first == channels.end()) return "";
  auto second = first;
  return ++second == channels.end() ? first.name() : "";
}

cv::Mat read_channel(const Bytes& bytes) {
  MemoryStream stream(bytes);
  Imf::InputFile file(stream);
  const Imath::Box2i window = file.header().dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;

  // Sizes of damaged headers are not allocated
  const std::string channel = depth_channel(file.header().channels());
  if (channel.empty() || width < 1 || height < 1 || width > 32768 || height > 32768 ||
      width * height > kMaxPixels)
    return {};

  // Subsampled channels are not depth
  const Imf::Channel* sampled = file.header().channels().findChannel(channel.c_str());
  if (sampled == nullptr || sampled->xSampling != 1 || sampled->ySampling != 1) return {};

  // OpenEXR counts pixels from the origin, not the window
  cv::Mat image(static_cast<int>(height), static_cast<int>(width), CV_32FC1, cv::Scalar(0));
  const std::size_t row = image.step[0];
  char* const origin = reinterpret_cast<char*>(image.data) - window.min.x * std::ptrdiff_t{sizeof(float)} -
                       window.min.y * static_cast<std::ptrdiff_t>(row);

  Imf::FrameBuffer buffer;
  buffer.insert(channel, Imf::Slice(Imf::FLOAT, origin, sizeof(float), row));
  file.setFrameBuffer(buffer);
  file.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

bool is_exr(const Bytes& file) {
  constexpr std::array<std::uint8_t, 4> kMagic = {0x76, 0x2F, 0x31, 0x01};
  return file.size() > kMagic.size() && std::memcmp(file.data(), kMagic.data(), kMagic.size()) == 0;
}

/// Empty if the file is damaged: OpenEXR reports that as exceptions.
cv::Mat decode_exr(const Bytes& file) {
  try {
    return read_channel(file);
  } catch (const std::bad_alloc&) {
    throw;  // no fault of the image
  } catch (const std::exception&) {
    return {};
  }
}

}  // namespace plumbline::dataset
