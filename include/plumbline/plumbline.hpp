// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Maps RGB-D recordings and live cameras from C++; docs/reference/cpp.md shows how. Lengths are metres, times
// seconds; poses are named target_from_source. No call throws: what fails is a core::Result without a value,
// with a message that a user can act on.
#include "plumbline/session/map.hpp"
#include "plumbline/session/mapper.hpp"
#include "plumbline/session/options.hpp"
#include "plumbline/session/result.hpp"
