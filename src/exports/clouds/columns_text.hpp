// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds as text: one row per point.
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::exports {

/// Names of a row's values: x y z red green blue, nx ny nz where normals are known, and the columns.
std::vector<std::string> text_columns(const cloud::CloudFile& file);
/// Writes one row per point, its values separated by `between`; metres have five decimals (0.01 mm).
void put_text_rows(core::OutputFile& out, const cloud::CloudFile& file, char between);

}  // namespace plumbline::exports
