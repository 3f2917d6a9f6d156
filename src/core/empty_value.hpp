// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "plumbline/core/options.hpp"

namespace plumbline::core {

/// True if the option may be an empty text: it is declared so, or that is its default, which has to read
/// back, since effective configurations have every option.
inline bool takes_empty(const OptionSpec& spec) {
  return spec.empty == EmptyValue::kAllowed || spec.default_value == "\"\"";
}

}  // namespace plumbline::core
