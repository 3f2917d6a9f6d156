// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Options that hold several numbers: "offset=0.01,scale=1%,holes".
#include <limits>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/core/options.hpp"

namespace plumbline::synth {

/// One number of such an option.
struct Setting {
  const char* key;
  double* value;  ///< not changed if the option does not name it
  core::Range<double> range;
  const char* unit;
  double strength = std::numeric_limits<double>::quiet_NaN();  ///< value if only named; NaN: one is needed
};

/// Reads "key=value,key,..." into the settings' values; numbers may have a unit. Errors (kUsage) name
/// option and key, with a suggestion.
core::Result<void> read_settings(const std::string& option, const std::string& text,
                                 const std::vector<Setting>& settings);

}  // namespace plumbline::synth
