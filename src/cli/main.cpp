// SPDX-License-Identifier: BSD-3-Clause
#ifdef __linux__
#include <malloc.h>
#endif

#include "app.hpp"

namespace {

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
  return plumbline::cli::run(argc, argv);
}
