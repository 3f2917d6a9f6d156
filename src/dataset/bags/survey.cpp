// SPDX-License-Identifier: BSD-3-Clause
#include "bags/survey.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <tuple>
#include <utility>

#include "bags/bag_parts.hpp"
#include "bags/body_messages.hpp"
#include "layout.hpp"
#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::dataset {
namespace {

namespace fs = std::filesystem;

/// A bag's file by its first bytes.
std::string kind_of_file(const fs::path& file) {
  std::array<char, 16> head{};
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return "";
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  const std::string_view begin(head.data(), head.size());
  const auto starts = [&begin](std::string_view with) { return begin.substr(0, with.size()) == with; };
  if (starts("\x89MCAP0\r\n")) return "mcap";
  if (starts(std::string_view("SQLite format 3\0", 16))) return "db3";
  if (starts("#ROSBAG V")) return "bag";
  if (!starts("\x28\xB5\x2F\xFD")) return "";
  const std::string inner = file.stem().extension().string();  // FILE.mcap.zstd
  return inner == ".mcap" ? "mcap" : inner == ".db3" ? "db3" : "";
}

/// The name in pieces, numbers by their value: bag_2.mcap comes before bag_10.mcap.
std::vector<std::pair<std::string, unsigned long long>> natural_key(const std::string& name) {
  std::vector<std::pair<std::string, unsigned long long>> key(1);
  constexpr unsigned long long kMost = ~0ULL / 16;
  bool number = false;
  for (const char c : name) {
    const bool digit = c >= '0' && c <= '9';
    if (!digit && number) key.emplace_back();
    number = digit;
    if (!digit) {
      key.back().first += c;
    } else if (key.back().second < kMost) {
      key.back().second = key.back().second * 10 + static_cast<unsigned long long>(c - '0');
    }
  }
  return key;
}

/// rosbag2's folders hold one bag, in several files where it was split.
std::vector<fs::path> files_of(const fs::path& path) {
  std::error_code ignored;
  if (!fs::is_directory(path, ignored)) return {path};
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(path, ignored)) {
    const std::string kind = kind_of_file(entry.path());
    if (kind == "mcap" || kind == "db3") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_key(a.filename().string()) < natural_key(b.filename().string());
  });
  return files;
}

/// Notes the files of a bag that Git LFS has not fetched; the others are read.
void note_missing_files(const fs::path& path, std::vector<std::string>& notes) {
  std::error_code ignored;
  std::vector<std::string> missing;
  for (const auto& entry : fs::directory_iterator(path, ignored)) {
    const std::string ending = core::ending_of(entry.path());
    const bool bag = ending == ".mcap" || ending == ".db3" || ending == ".zstd";
    if (bag && core::is_lfs_pointer(entry.path()))
      missing.push_back(fmt::format("{}: {}", entry.path().string(), core::kLfsPointer));
  }
  std::sort(missing.begin(), missing.end());
  notes.insert(notes.end(), missing.begin(), missing.end());
}

/// Null for encodings that are not read.
const MessageDecoder* decoder_of(const BagReaders& readers, const std::string& encoding) {
  if (encoding == "cdr" || encoding.empty()) return &readers.cdr();
  return encoding == "ros1" ? &readers.ros1() : nullptr;
}

/// Goes through files and collects the survey.
class Surveyor {
 public:
  Surveyor(BagSurvey& survey, const BagReaders& readers) : survey_(survey), readers_(readers) {}

  core::Result<void> add(const fs::path& path) {
    auto opened = readers_.open(path);
    if (!opened) return tl::unexpected(opened.error());
    std::unique_ptr<BagFile> bag = std::move(*opened);
    topics_of_file_.clear();
    const auto file = static_cast<std::uint32_t>(survey_.files.size());
    auto scanned = bag->scan([&](const BagEntry& entry) { visit(*bag, file, entry); });
    if (!scanned) return scanned;
    // Topics without a message are listed too.
    for (std::size_t i = 0; i < bag->topics().size(); ++i) topic_of(*bag, i);
    survey_.notes.insert(survey_.notes.end(), bag->notes().begin(), bag->notes().end());
    if (survey_.camera_yaml.empty()) survey_.camera_yaml = bag->camera_yaml();
    survey_.files.push_back(std::move(bag));
    return {};
  }
  [[nodiscard]] std::size_t without_stamp() const { return without_stamp_; }

 private:
  SurveyedTopic& topic_of(const BagFile& bag, std::size_t number) {
    // Files of one bag share their topics
    while (topics_of_file_.size() <= number) {
      const BagTopic& topic = bag.topics().at(topics_of_file_.size());
      const auto same = [&topic](const SurveyedTopic& other) {
        return std::tie(other.topic.name, other.topic.type, other.topic.encoding) ==
               std::tie(topic.name, topic.type, topic.encoding);
      };
      const auto known = std::find_if(survey_.topics.begin(), survey_.topics.end(), same);
      topics_of_file_.push_back(static_cast<std::size_t>(known - survey_.topics.begin()));
      if (known != survey_.topics.end()) continue;
      SurveyedTopic added;
      added.topic = topic;
      added.decoder = decoder_of(readers_, topic.encoding);
      survey_.topics.push_back(std::move(added));
    }
    return survey_.topics[topics_of_file_[number]];
  }

  void visit(const BagFile& bag, std::uint32_t file, const BagEntry& entry) {
    SurveyedTopic& topic = topic_of(bag, entry.topic);
    topic.first_ns = topic.count == 0 ? entry.log_ns : std::min(topic.first_ns, entry.log_ns);
    topic.last_ns = topic.count == 0 ? entry.log_ns : std::max(topic.last_ns, entry.log_ns);
    ++topic.count;

    // A bag may consist of several files
    MessagePlace place = entry.place;
    place.file = file;

    // Images are listed by their own stamps
    if (!topic.has_images()) {
      if (topic.others.size() < kFewMessages || tells_of_body(topic.topic)) topic.others.push_back(place);
    } else if (topic.decoder != nullptr) {
      const auto stamp = topic.decoder->stamp(entry.head, entry.head_size);

      // Images without a stamp cannot be paired
      if (stamp) {
        topic.images.push_back({*stamp, entry.log_ns, place});
      } else {
        ++without_stamp_;
      }
    }
  }

  BagSurvey& survey_;
  const BagReaders& readers_;
  std::vector<std::size_t> topics_of_file_;
  std::size_t without_stamp_ = 0;
};

}  // namespace

double SurveyedTopic::rate() const {
  const double span_ns = static_cast<double>(last_ns) - static_cast<double>(first_ns);
  return count < 2 || span_ns <= 0.0 ? 0.0 : static_cast<double>(count - 1) * 1e9 / span_ns;
}

const SurveyedTopic* BagSurvey::find(const std::string& name) const {
  const auto named = [&name](const SurveyedTopic& topic) { return topic.topic.name == name; };
  const auto found = std::find_if(topics.begin(), topics.end(), named);
  return found == topics.end() ? nullptr : &*found;
}

bool is_bag(const fs::path& path) {
  if (is_folder(path) && layout_of(path) != nullptr) return false;
  const std::vector<fs::path> files = files_of(path);
  return !files.empty() && !kind_of_file(files.front()).empty();
}

core::Result<BagSurvey> survey_bag(const fs::path& path) {
  BagSurvey survey;
  survey.path = path.string();
  const auto& readers = core::part<BagReaders>();
  if (!readers) return tl::unexpected(readers.error());

  Surveyor surveyor(survey, **readers);
  core::Error first_problem;
  for (const fs::path& file : files_of(path)) {
    survey.kind = kind_of_file(file);
    const auto added = surveyor.add(file);
    if (added) continue;
    // One damaged file among several is only noted; if there is no other file, it is an error.
    if (first_problem.message.empty()) first_problem = added.error();
    survey.notes.push_back(added.error().message);
  }

  if (survey.files.empty()) return tl::unexpected(first_problem);
  note_missing_files(path, survey.notes);
  if (surveyor.without_stamp() > 0) {
    survey.notes.push_back(fmt::format("{}: {} images have a damaged head and are left out", survey.path,
                                       surveyor.without_stamp()));
  }

  const bool any = std::any_of(survey.topics.begin(), survey.topics.end(),
                               [](const SurveyedTopic& topic) { return topic.count > 0; });
  if (!any) {
    std::string message = fmt::format("{}: holds no message that can be read", survey.path);
    for (const std::string& note : survey.notes) message += "; " + note;
    return core::input_error(message);
  }

  std::sort(survey.topics.begin(), survey.topics.end(), [](const SurveyedTopic& a, const SurveyedTopic& b) {
    return std::tie(a.topic.name, a.topic.type) < std::tie(b.topic.name, b.topic.type);
  });

  return survey;
}

}  // namespace plumbline::dataset
