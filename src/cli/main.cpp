// SPDX-License-Identifier: BSD-3-Clause
#ifdef __linux__
#include <malloc.h>
#endif

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "app.hpp"
#include "plumbline/core/shortage.hpp"

namespace {

/// oneTBB starts its threads where no exception may leave: a shortage there is reported like any other.
[[noreturn]] void end_at_shortage() {
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::exception& problem) {
    if (const plumbline::core::Error error = plumbline::core::error_of(problem);
        error.kind == plumbline::core::ErrorKind::kOutput) {
      std::fprintf(stderr, "plumbline: error: %s\n", error.message.c_str());
      _exit(static_cast<int>(error.kind));
    }
  } catch (...) {
  }

  std::abort();
}

/// Every frame allocates and frees the same images and clouds. The allocator keeps their pages instead of
/// requesting zeroed ones from the system each time; run_graph() returns the rest once all frames are mapped.
void keep_pages() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 16 << 20);
  mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  keep_pages();
  std::set_terminate(end_at_shortage);
  return plumbline::cli::run(argc, argv);
}
