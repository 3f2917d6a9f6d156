// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Clouds as text: one row a point.
#include <string>
#include <vector>

#include "plumbline/cloud/io/cloud_io.hpp"
#include "plumbline/core/output_file.hpp"

namespace plumbline::exports {

/// Names of a row's values: x y z red green blue, nx ny nz where normals are known, and the columns.
std::vector<std::string> text_columns(const cloud::CloudFile& file);
/// One row a point, its values apart by `between`: metres with five decimals (a hundredth of a millimetre).
void put_text_rows(core::OutputFile& out, const cloud::CloudFile& file, char between);

}  // namespace plumbline::exports
