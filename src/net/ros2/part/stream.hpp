// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "plumbline/core/error.hpp"
#include "plumbline/dataset/message_stream.hpp"
#include "plumbline/net/options.hpp"

namespace plumbline::net {

core::Result<std::unique_ptr<dataset::MessageStream>> open_stream(const NetworkOptions& options);
core::Result<std::unique_ptr<dataset::MessageSink>> open_sink(const NetworkOptions& options);

}  // namespace plumbline::net
