// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages as ROS 1 serialized them: fields one after another, little endian, lists behind their length.
#include "bags/messages.hpp"

namespace plumbline::dataset {

const MessageDecoder& ros1_decoder();

}  // namespace plumbline::dataset
