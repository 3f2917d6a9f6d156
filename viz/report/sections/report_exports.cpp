// SPDX-License-Identifier: BSD-3-Clause
// Files that were exported into the folder: plans as pictures, the rest as links.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <system_error>

#include "report_sections.hpp"

namespace plumbline::report {
namespace {

namespace fs = std::filesystem;

struct ExportedForm {
  const char* ending;
  const char* what;
};
constexpr std::array<ExportedForm, 14> kExportedForms{{{".svg", "plan or section"},
                                                       {".pdf", "plan or section"},
                                                       {".dxf", "plan for CAD"},
                                                       {".pgm", "occupancy grid for Nav2"},
                                                       {".las", "cloud for surveyors' programs"},
                                                       {".glb", "for browsers and viewers"},
                                                       {".bt", "OctoMap"},
                                                       {".ot", "OctoMap with colours"},
                                                       {".obj", "mesh"},
                                                       {".xyz", "cloud as text"},
                                                       {".kitti", "path, KITTI"},
                                                       {".tum", "path, TUM"},
                                                       {"poses.csv", "poses with covariance"},
                                                       {".georeference.json", "where on Earth it lies"}}};

bool ends_so(const std::string& name, const std::string& ending) {
  return name.size() >= ending.size() &&
         name.compare(name.size() - ending.size(), ending.size(), ending) == 0;
}

/// Empty: no export.
std::string form_of(const fs::path& file) {
  std::error_code ec;
  if (fs::is_directory(file, ec))
    return fs::exists(file / "plumbline_export.txt", ec) ? "pictures and poses, as a folder" : "";
  for (const ExportedForm& form : kExportedForms) {
    if (ends_so(file.filename().string(), form.ending)) return form.what;
  }
  return {};
}

}  // namespace

std::string exports_html(const ReportData& data) {
  std::vector<fs::path> files;
  std::error_code ec;
  for (fs::directory_iterator it(data.folder, ec), end; !ec && it != end; it.increment(ec)) {
    if (!form_of(it->path()).empty()) files.push_back(it->path());
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) return {};

  // A link for each file.
  std::string pictures;
  std::string links;
  for (const fs::path& file : files) {
    const std::string name = viz::markup_text(file.filename().string());
    links += fmt::format("<li><a href=\"{0}\">{0}</a>: {1}</li>\n", name, viz::markup_text(form_of(file)));
    if (file.extension() != ".svg") continue;

    // Vector drawings are shown in the page.
    const std::string bytes = read_bytes(file);
    if (bytes.find("</svg>") == std::string::npos) continue;  // not whole
    pictures += fmt::format(
        "<figure><img alt=\"{0}\" "
        "src=\"data:image/svg+xml;base64,{1}\"/><figcaption>{0}</figcaption></figure>\n",
        name, base64(bytes));
  }
  if (!pictures.empty()) pictures = "<div class=\"plans\">" + pictures + "</div>\n";
  return pictures + "<ul>\n" + links + "</ul>\n" + note("Files beside this page, made by plumbline export.");
}

}  // namespace plumbline::report
