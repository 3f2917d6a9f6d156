// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/maps/unfinished_run.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

namespace plumbline::maps {

bool is_running(const std::filesystem::path& partial) {
  const int descriptor = open((partial / kUnfinishedMarker).c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool locked = flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  close(descriptor);
  return locked;
}

}  // namespace plumbline::maps
