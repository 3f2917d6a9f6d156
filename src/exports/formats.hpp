// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The table of formats. Each format is one source file with one function that returns its entry.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/exports/export.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

struct Format {
  std::string name;
  /// File name endings, the longest match decides; of equal ones the first format that can hold the content
  /// that is asked for. Empty: a folder.
  std::vector<std::string> endings;
  std::vector<Content> contents;  ///< possible contents, the default first
  std::string needs;              ///< "map.db" or "recording" besides a map; empty: a cloud is enough
  std::string title;
  std::string description;           ///< Markdown
  std::vector<std::string> options;  ///< keys of ExportOptions besides common_options()
  core::Result<ExportSummary> (*write)(MapSource& source, const std::filesystem::path& output);
};

/// Adds a note if the cloud has no colour; for formats that cannot leave colour out.
void note_colorless(const cloud::CloudFile& file, ExportSummary& summary);

/// All formats, those needed most first.
const std::vector<Format>& formats();
/// Options that all formats take.
const std::vector<std::string>& common_options();

// One per source file, in this folder's subfolders.
Format colmap_format();
Format nerfstudio_format();
Format grid_format();
Format las_format();
Format glb_format();
Format tum_format();
Format kitti_format();
Format euroc_format();
Format poses_format();
Format path_format();
Format plan_format();
Format octomap_format();
Format ply_format();
Format pcd_format();
Format csv_format();
Format xyz_format();
Format mesh_format();
Format lines_format();
Format html_format();

}  // namespace plumbline::exports
