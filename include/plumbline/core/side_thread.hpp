// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <thread>

#include "plumbline/core/stop.hpp"

namespace plumbline::core {

/// A thread that works until this object is destroyed. Declare it as the last member, after all that it uses.
class SideThread {
 public:
  explicit SideThread(const std::function<void(const StopToken&)>& work)
      : thread_([this, work] { work(stop_); }) {}
  SideThread(const SideThread&) = delete;
  SideThread& operator=(const SideThread&) = delete;
  ~SideThread() {
    stop_.request_stop();
    thread_.join();
  }

 private:
  StopToken stop_;
  std::thread thread_;
};

}  // namespace plumbline::core
