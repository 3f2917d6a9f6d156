// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The table of formats. A format is one file that gives one of these.
#include <filesystem>
#include <string>
#include <vector>

#include "plumbline/exports/export.hpp"
#include "source/map_source.hpp"

namespace plumbline::exports {

struct Format {
  std::string name;
  std::vector<std::string> endings;  ///< of the output's name; the longest that fits wins. Empty: a folder
  std::vector<Content> contents;     ///< that it can hold; the first one is the default
  std::string needs;                 ///< besides a map: "map.db", "recording"; empty: a cloud does
  std::string title;
  std::string description;           ///< Markdown
  std::vector<std::string> options;  ///< keys of ExportOptions, besides those that all take
  core::Result<ExportSummary> (*write)(MapSource& source, const std::filesystem::path& output);
};

/// Says so if a cloud has no colour: these formats cannot leave it out.
void note_colorless(const cloud::CloudFile& file, ExportSummary& summary);

/// By what users need most.
const std::vector<Format>& formats();
/// Options that all formats take.
const std::vector<std::string>& common_options();

// One a file, in this folder's subfolders.
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
