// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Request to end a run in order (Ctrl-C). Cheap to copy and to query.
#include <atomic>
#include <memory>

namespace plumbline::core {

class StopToken {
 public:
  StopToken() : flag_(std::make_shared<std::atomic<bool>>(false)) {}
  void request_stop() const { flag_->store(true, std::memory_order_relaxed); }
  [[nodiscard]] bool stop_requested() const { return flag_->load(std::memory_order_relaxed); }

 private:
  std::shared_ptr<std::atomic<bool>> flag_;
};

}  // namespace plumbline::core
