// SPDX-License-Identifier: BSD-3-Clause
#include "background.hpp"

#include <chrono>
#include <opencv2/core/utility.hpp>

#include "plumbline/core/shortage.hpp"
#include "plumbline/core/text.hpp"

namespace plumbline::python {
namespace {

// OpenCV's number of threads is one for the whole process.
std::mutex opencv_mutex;
int opencv_users = 0;
int opencv_before = 0;

const char* level_name(core::LogLevel level) {
  switch (level) {
    case core::LogLevel::kDebug:
      return "DEBUG";
    case core::LogLevel::kInfo:
      return "INFO";
    case core::LogLevel::kWarning:
      return "WARNING";
    case core::LogLevel::kError:
      return "ERROR";
  }
  return "INFO";
}

}  // namespace

void QueueLog::write(core::LogLevel level, const std::string& message) {
  const std::lock_guard lock(mutex_);
  lines_.emplace_back(level_name(level), core::printable(message));
}

std::vector<LogLine> QueueLog::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(lines_, {});
}

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

Background::Background(Work work) {
  thread_ = std::thread([this, work = std::move(work)] {
    core::Result<pipeline::RunSummary> result;

    try {
      const OpenCvThreads one;
      result = work(log_, stop_, [this](std::size_t frames, std::size_t total) {
        frames_ = frames;

        total_ = total;
      });
    } catch (const std::exception& e) {
      core::Error error = core::error_of(e);
      if (error.kind == core::ErrorKind::kInternal) error.message.insert(0, "internal error: ");
      result = tl::unexpected(error);
    }

    const std::lock_guard lock(mutex_);
    result_ = std::move(result);
    done_ = true;
    ended_.notify_all();
  });
}

Background::~Background() {
  stop_.request_stop();
  const py::gil_scoped_release free;
  thread_.join();
}

bool Background::wait(double seconds) {
  const py::gil_scoped_release free;
  std::unique_lock lock(mutex_);
  return ended_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return done_.load(); });
}

std::string Background::reason() {
  const std::lock_guard lock(mutex_);
  if (!result_) throw Failure({core::ErrorKind::kInternal, "the run has not ended yet"});
  if (!*result_) throw Failure(result_->error());
  return (*result_)->reason;
}

}  // namespace plumbline::python
