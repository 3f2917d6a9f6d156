// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/open_bag.hpp"

#include <fmt/format.h>

#include <array>
#include <string_view>
#include <utility>

#include "bag_part/binary_file.hpp"
#include "bag_part/compression.hpp"
#include "bag_part/db3.hpp"
#include "bag_part/mcap.hpp"
#include "bag_part/ros1_bag.hpp"

namespace plumbline::dataset {
namespace {

/// A bag in a temporary file that is removed with it.
class UnpackedBag final : public BagFile {
 public:
  UnpackedBag(TemporaryFile file, std::unique_ptr<BagFile> bag)
      : file_(std::move(file)), bag_(std::move(bag)) {}

  core::Result<void> scan(const Visit& visit) override {
    auto done = bag_->scan(visit);
    notes_.insert(notes_.end(), bag_->notes().begin(), bag_->notes().end());
    return done;
  }
  [[nodiscard]] core::Result<Bytes> read(const MessagePlace& place) const override {
    return bag_->read(place);
  }
  [[nodiscard]] const std::vector<BagTopic>& topics() const override { return bag_->topics(); }
  [[nodiscard]] const std::vector<std::string>& notes() const override { return notes_; }
  [[nodiscard]] std::string camera_yaml() const override { return bag_->camera_yaml(); }
  void add_note(std::string note) { notes_.push_back(std::move(note)); }

 private:
  TemporaryFile file_;
  std::unique_ptr<BagFile> bag_;
  std::vector<std::string> notes_;
};

/// The content decides, whatever the file's name.
OpenedBag open_plain(const std::filesystem::path& file, const std::string& shown) {
  if (is_mcap(file)) return open_mcap(file, shown);
  const auto opened = BinaryFile::open(file);
  std::array<char, 7> magic{};
  const bool ros1 = opened && opened->read(0, magic.data(), magic.size()) &&
                    std::string_view(magic.data(), magic.size()) == "#ROSBAG";
  return ros1 ? open_ros1_bag(file, shown) : open_db3(file, shown);
}

}  // namespace

OpenedBag open_bag_file(const std::filesystem::path& file) {
  const auto opened = BinaryFile::open(file);
  if (!opened) return tl::unexpected(opened.error());
  std::array<std::uint8_t, 4> magic{};
  const bool packed = opened->read(0, magic.data(), magic.size()) && is_zstd(magic.data(), magic.size());
  if (!packed) return open_plain(file, file.string());

  // rosbag2 can compress a whole file
  bool cut = false;
  auto temporary = TemporaryFile::inflated(file, cut);
  if (!temporary) return tl::unexpected(temporary.error());
  auto bag = open_plain(temporary->path(), file.string());
  if (!bag) return bag;

  // A file without a name vanishes with the program
  temporary->take_name_away();
  auto unpacked = std::make_unique<UnpackedBag>(std::move(*temporary), std::move(*bag));
  if (cut) unpacked->add_note(file.string() + ": is cut off or damaged; what could be unpacked is used");
  return unpacked;
}

}  // namespace plumbline::dataset
