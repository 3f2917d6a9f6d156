// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/session/background.hpp"

#include <chrono>
#include <opencv2/core/utility.hpp>

#include "guarded.hpp"

namespace plumbline::session {
namespace {

// OpenCV's number of threads is one for the whole process.
std::mutex opencv_mutex;
int opencv_users = 0;
int opencv_before = 0;

}  // namespace

OpenCvThreads::OpenCvThreads() {
  const std::lock_guard lock(opencv_mutex);
  if (opencv_users++ > 0) return;
  opencv_before = cv::getNumThreads();
  cv::setNumThreads(1);
}

OpenCvThreads::~OpenCvThreads() {
  const std::lock_guard lock(opencv_mutex);
  if (--opencv_users == 0) cv::setNumThreads(opencv_before);
}

Background::Background(core::StopToken stop, Work work) : stop_(std::move(stop)) {
  // The result is stored before anybody is woken
  thread_ = std::thread([this, work = std::move(work)] {
    auto result = guarded(work);

    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
    done_ = true;
    ended_.notify_all();
  });
}

Background::~Background() {
  if (!done_) stop_.request_stop();
  thread_.join();
}

bool Background::wait(double seconds) {
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return done_.load(); });
}

core::Result<pipeline::RunSummary> Background::result() {
  const std::lock_guard lock(mutex_);
  if (!result_) return core::failure(core::ErrorKind::kInternal, "the run has not ended yet");
  return *result_;
}

}  // namespace plumbline::session
