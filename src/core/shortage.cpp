// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/shortage.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

namespace plumbline::core {
namespace {

const char* const kMemory = "not enough memory: free some, or raise the limit (ulimit -v)";
const char* const kOpenFiles = "too many open files: raise the limit (ulimit -n)";
const char* const kThreads =
    "no further thread can be started: free memory, or raise the limit of processes (ulimit -u)";

bool holds(const std::string& text, const char* part) { return text.find(part) != std::string::npos; }

}  // namespace

/// Advice on a lack of memory or file handles; empty for other causes.
std::string shortage_of(int cause) {
  switch (cause) {
    case ENOMEM:
      return kMemory;
    case EMFILE:
    case ENFILE:
      return kOpenFiles;
    default:
      return "";
  }
}

std::string shortage_of(const std::exception& problem) {
  if (dynamic_cast<const std::bad_alloc*>(&problem) != nullptr) return kMemory;
  if (const auto* of_system = dynamic_cast<const std::system_error*>(&problem)) {
    const int code = of_system->code().value();
    return code == EAGAIN ? kThreads : shortage_of(code);
  }

  // OpenCV's StsNoMem and oneTBB's workers; this module does not know their exceptions.
  const std::string text = problem.what();
  if (holds(text, "pthread_create has failed")) return kThreads;
  return holds(text, "(-4:Insufficient memory)") || holds(text, "OutOfMemoryError") ? kMemory : "";
}

std::string shortage_of_linker(const std::string& message) {
  // The dynamic linker reports its errors as text only
  if (holds(message, std::strerror(EMFILE)) || holds(message, std::strerror(ENFILE))) return kOpenFiles;
  const bool memory = holds(message, std::strerror(ENOMEM)) || holds(message, "failed to map segment") ||
                      holds(message, "cannot create shared object descriptor") ||
                      holds(message, "cannot map zero-fill pages") ||
                      holds(message, "cannot allocate memory");
  return memory ? kMemory : "";
}

bool files_are_short() {
  const int descriptor = open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (descriptor >= 0) close(descriptor);
  return descriptor < 0 && (errno == EMFILE || errno == ENFILE);
}

Error error_of(const std::exception& problem) {
  const std::string shortage = shortage_of(problem);
  if (!shortage.empty()) return {ErrorKind::kOutput, shortage};
  return {ErrorKind::kInternal, problem.what()};
}

}  // namespace plumbline::core
