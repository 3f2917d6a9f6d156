// SPDX-License-Identifier: BSD-3-Clause
#include "ros2/ros2_part.hpp"
#include "stream.hpp"

PLUMBLINE_PART(plumbline::net::Ros2Part, &plumbline::net::open_stream, &plumbline::net::open_sink)
