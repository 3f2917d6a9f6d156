// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "plumbline/core/git_lfs.hpp"

namespace plumbline::core {
namespace {

using Json = nlohmann::ordered_json;

/// Goes through a text without building anything, and stops at the first thing that must not be built.
class Checker : public Json::json_sax_t {
 public:
  bool null() override { return true; }
  bool boolean(bool /*value*/) override { return true; }
  bool number_integer(Json::number_integer_t /*value*/) override { return true; }
  bool number_unsigned(Json::number_unsigned_t /*value*/) override { return true; }
  bool number_float(Json::number_float_t /*value*/, const std::string& /*text*/) override { return true; }
  bool string(std::string& /*value*/) override { return true; }
  bool binary(Json::binary_t& /*value*/) override { return true; }

  bool start_object(std::size_t /*size*/) override { return open(); }
  bool start_array(std::size_t /*size*/) override { return open(); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool key(std::string& /*name*/) override {
    if (++keys_.back() <= JsonLimits::kKeys) return true;
    problem_ = fmt::format("an object with more than {} keys is not read", JsonLimits::kKeys);
    return false;
  }

  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    problem_ = "is not valid JSON";
    return false;
  }

  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  bool open() {
    keys_.push_back(0);
    if (keys_.size() <= JsonLimits::kDepth) return true;
    problem_ = fmt::format("lists and objects nested deeper than {} levels are not read", JsonLimits::kDepth);
    return false;
  }
  bool close() {
    keys_.pop_back();
    return true;
  }

  std::vector<std::size_t> keys_;  ///< of each object that is open; 0 for lists
  std::string problem_;
};

/// "FILE:LINE:COLUMN" of the byte behind so many others.
std::string place(std::string_view text, std::size_t bytes, const std::string& name) {
  const std::string_view before = text.substr(0, bytes);
  const std::size_t line_start = before.rfind('\n');
  const std::size_t column = before.size() - (line_start == std::string_view::npos ? 0 : line_start + 1);
  return fmt::format("{}:{}:{}", name, std::count(before.begin(), before.end(), '\n') + 1, column + 1);
}

}  // namespace

Result<Json> parse_json(std::string_view text, const std::string& name) {
  if (text.size() > JsonLimits::kBytes)
    return input_error(
        fmt::format("{}: more than {} MB of JSON are not read", name, JsonLimits::kBytes / 1'000'000));

  // Limits are checked before anything is allocated
  Checker checker;
  std::istringstream stream{std::string(text)};
  if (!Json::sax_parse(stream, &checker)) {
    const auto taken = static_cast<std::size_t>(stream.rdbuf()->pubseekoff(0, std::ios::cur, std::ios::in));
    return input_error(
        fmt::format("{}: {}", place(text, taken > 0 ? taken - 1 : 0, name), checker.problem()));
  }
  return Json::parse(text.begin(), text.end(), nullptr, false);
}

Result<Json> read_json(const std::filesystem::path& file) {
  std::error_code problem;
  const std::uintmax_t size = std::filesystem::file_size(file, problem);
  std::ifstream stream(file, std::ios::binary);
  if (problem || !stream)
    return input_error(fmt::format(
        "{}: cannot be read: {}", file.string(),
        std::filesystem::exists(file, problem) ? "no permission, or not a file" : "no such file"));

  // One byte more than is allowed, for a size that a file system does not tell.
  std::string text(std::min<std::uintmax_t>(size, JsonLimits::kBytes) + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (begins_as_lfs_pointer(text)) return input_error(fmt::format("{}: {}", file.string(), kLfsPointer));
  return parse_json(text, file.string());
}

std::string json_text(const Json& json, int indent) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace) + (indent < 0 ? "" : "\n");
}

}  // namespace plumbline::core
