// SPDX-License-Identifier: BSD-3-Clause
#include "taps/tap_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "plumbline/core/output_file.hpp"

namespace plumbline::pipeline {

namespace fs = std::filesystem;

void Tap::declare(core::OptionTable& table) {
  table.text("file", file_,
             count_ == Count::kOne
                 ? fmt::format("Below the result folder; ends with {}", fmt::join(endings_, " or "))
                 : fmt::format("Below the result folder, with a * for the number; ends with {}",
                               fmt::join(endings_, " or ")));
  if (count_ == Count::kFrames) table.integer("every", every_, {1, 100000}, "", "Every n-th frame");
}

void Tap::check(const CheckContext& /*context*/, const core::ConfigMark& mark, const std::string& path,
                core::ConfigProblems& problems) {
  const auto refuse = [&](std::string what) { problems.push_back({mark, path + ".file", std::move(what)}); };
  const std::string example = (count_ != Count::kOne ? "tap/*" : "tap") + endings_[0];

  if (file_.empty()) return refuse(fmt::format("a tap needs a file, e.g. file: {}", example));

  // A tap is part of the result, which appears whole or not at all: it must not lie outside of the folder.
  const fs::path normal = fs::path(file_).lexically_normal();
  const bool outside = normal.is_absolute() || (!normal.empty() && *normal.begin() == "..");
  if (outside || !normal.has_filename()) {
    return refuse(fmt::format("{} is not a file below the result folder, such as {}", file_, example));
  }

  if (std::any_of(file_.begin(), file_.end(), [](unsigned char c) { return c < 0x20; })) {
    return refuse("the file's name contains control characters");
  }

  if (std::find(endings_.begin(), endings_.end(), ending()) == endings_.end()) {
    refuse(fmt::format("{}: a {} is not written here (allowed: {})", file_,
                       ending().empty() ? "file without ending" : ending() + " file",
                       fmt::join(endings_, ", ")));
  }

  // Without a number in its name each file would overwrite the one before.
  const auto stars = std::count(file_.begin(), file_.end(), '*');
  if (count_ == Count::kOne && stars != 0) refuse(file_ + ": one file is written here; leave out the *");
  if (count_ != Count::kOne && (stars != 1 || normal.filename().string().find('*') == std::string::npos)) {
    refuse(fmt::format("{}: many files are written here; put one * into the name for the number, e.g. {}",
                       file_, example));
  }
}

std::string Tap::with(const std::string& middle) const {
  const fs::path file(file_);
  return (file.parent_path() / (file.stem().string() + middle + ending())).string();
}

core::Result<void> Tap::start(const RunContext& context) {
  result_folder_ = context.output_folder;
  return core::make_folder(path().parent_path());
}

fs::path Tap::path(std::size_t number, const std::string& middle) const {
  std::string name = with(middle);
  const std::size_t star = name.find('*');
  if (star != std::string::npos) name.replace(star, 1, fmt::format("{:06}", number));
  return result_folder_ / name;
}

}  // namespace plumbline::pipeline
