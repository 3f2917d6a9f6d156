// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A map in the forms that other programs read.
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/executor.hpp"
#include "plumbline/core/log.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/exports/options.hpp"

namespace plumbline::exports {

/// Part of a map that is written.
enum class Content { kCloud, kMesh, kTrajectory, kKeyframes, kLines };

/// Input and options with which a recording was read when it was mapped.
struct RecordingName {
  std::string input;   ///< as given to `map`
  std::string camera;  ///< shipped name or file; empty: the recording's own
  std::string format;  ///< "auto", or a layout
};
using OpenRecording =
    std::function<core::Result<std::unique_ptr<dataset::FrameSource>>(const RecordingName&)>;

struct ExportRequest {
  std::filesystem::path input;        ///< result folder, map.db, OUT of an interrupted run, or a cloud
  std::filesystem::path output;       ///< a file, or a folder for the forms that are one
  std::string format;                 ///< name of a Format; empty: by the ending of `output`
  Content content = Content::kCloud;  ///< distinguishes formats with the same ending
  std::string robot;  ///< robot whose map is used, of an interrupted run of several; empty: the only one
  /// Recordings for the pictures, in the order of the robots; empty: those that the map was made from.
  std::vector<std::string> recordings;
  OpenRecording open;  ///< null: there are no pictures
  /// Runs work while suppressing output of libraries (Poisson's); null: just runs it.
  std::function<void(const std::function<void()>&)> quietly = nullptr;
  ExportOptions options;
  bool replace = false;         ///< an earlier export's folder may be replaced
  std::set<std::string> given;  ///< keys of options that were set: each must be one of the format's
};

struct ExportSummary {
  std::string format;                          ///< its name
  std::vector<std::filesystem::path> written;  ///< files, or one folder
  std::vector<std::string> notes;              ///< whole sentences on missing parts and on findings
};

/// Tells how far the work is.
using ExportProgress = std::function<void(std::size_t done, std::size_t total)>;

/// Everything appears whole or not at all. Errors: kUsage (no such format, an option that it has not, a part
/// of the map that is not there), kInput (the map), kOutput (cannot be written; nothing is left behind).
core::Result<ExportSummary> write_export(const ExportRequest& request, const core::Executor& executor,
                                         core::Log& log, const ExportProgress& progress);

/// Checks format, ending and options without reading the map. Errors (kUsage).
core::Result<void> check_export(const ExportRequest& request);

/// One row of the table of formats.
struct FormatInfo {
  std::string name;                  ///< name for --format
  std::string endings;               ///< ".yaml .pgm", or "folder"
  std::string content;               ///< "cloud", "mesh", ...: distinguishes formats with the same ending
  std::string needs;                 ///< "cloud", "map.db", "map.db, recording"
  std::string title;                 ///< one line
  std::string description;           ///< Markdown: the format's conventions and its use
  std::vector<std::string> options;  ///< keys of ExportOptions
};
std::vector<FormatInfo> export_formats();
/// docs/guide/exports.md.
std::string exports_page();

}  // namespace plumbline::exports
