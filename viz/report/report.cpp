// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/report/report.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <system_error>
#include <utility>

#include "plumbline/core/output_file.hpp"
#include "plumbline/core/version.hpp"
#include "report_sections.hpp"

namespace plumbline::report {
namespace {

namespace fs = std::filesystem;

/// True if a file is the report of an earlier call.
bool is_report(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::string head(512, '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.rfind("<!DOCTYPE html>", 0) == 0 && head.find(kReportGenerator) != std::string::npos;
}

/// A camera that was lost has a second map, which is joined like that of another robot.
std::string merges_title(const ReportData& data) {
  const bool several = data.fused_afterwards || data.paths.size() > 1 || data.frames.size() > 1;
  return several ? "Merges of robots' maps" : "Maps of a camera that was lost, joined";
}

core::Result<void> check_output(const fs::path& file, bool replace) {
  std::error_code ec;
  if (fs::is_directory(file, ec)) {
    return core::usage_error(
        fmt::format("{}: is a folder; name a file, such as report.html in it", file.string()));
  }

  // A new file is always permitted.
  if (!fs::is_regular_file(file, ec)) return {};
  if (!is_report(file)) {
    return core::usage_error(fmt::format(
        "{}: exists and is not a report; name another file (only reports are ever replaced)", file.string()));
  }
  if (replace) return {};
  return core::usage_error(fmt::format(
      "{}: holds an earlier report; name another file with -o or add --force to replace it", file.string()));
}

}  // namespace

core::Result<ReportSummary> write_report(const ReportRequest& request, const core::Executor& executor,
                                         core::Log& log) {
  const fs::path file = request.output.empty() ? request.result / "report.html" : request.output;

  // Input and output are checked first.
  auto data = read_report_data(request.result);
  if (!data) return tl::unexpected<core::Error>(data.error());
  if (auto free = check_output(file, request.replace); !free)
    return tl::unexpected<core::Error>(free.error());

  if (!data->kind.empty()) log.info(fmt::format("{}: its {}", request.result.string(), data->kind));

  // Truth adds accuracy.
  if (!request.truth.empty()) {
    if (auto added = add_truth(request.truth, *data); !added)
      return tl::unexpected<core::Error>(added.error());
  }

  // Drawn through a hidden file in the same folder.
  fs::path scratch = file;
  scratch.replace_filename(fmt::format(".{}.{}.png", file.filename().string(), getpid()));
  auto pictures = pictures_html(*data, scratch);  // first, because the head reports damaged ones
  if (!pictures) return tl::unexpected<core::Error>(pictures.error());

  auto viewer = viewer_html(*data, request, executor, log);
  if (!viewer) return tl::unexpected<core::Error>(viewer.error());

  const auto head = head_html(*data, request);
  if (!head) return tl::unexpected<core::Error>(head.error());

  // Sections without text are left out.
  const std::string page = page_html(
      "Plumbline report: " + (request.title.empty() ? data->name : request.title), *head,
      {{"map", "The map to walk through", std::move(*viewer)},
       {"pictures", "Pictures", std::move(*pictures)},
       {"exports", "Exports", exports_html(*data)},
       {"accuracy", "Accuracy", accuracy_html(*data)},
       {"run", "The run", run_html(*data), true},
       {"path", "The path", path_html(*data), true},
       {"tracking", "Tracking over time", tracking_html(*data), true},
       {"loops", "Loops", loops_html(*data), true},
       {"merges", merges_title(*data), merges_html(*data), true},
       {"refinement", "Refinement of the whole", refinement_html(*data), true},
       {"cloud", "The cloud", cloud_html(*data), true},
       {"cost", "Time and memory", cost_html(*data), true},
       {"configuration", "Configuration", configuration_html(*data), true},
       {"files", "Files", files_html(*data, file), true}},
      fmt::format("Written by plumbline {} from the result folder {}.", core::version(), data->name));

  if (auto written = core::write_file(file, page); !written)
    return tl::unexpected<core::Error>(written.error());

  return ReportSummary{file, page.size(), std::move(data->missing)};
}

}  // namespace plumbline::report
