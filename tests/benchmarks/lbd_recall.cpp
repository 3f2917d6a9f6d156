// SPDX-License-Identifier: BSD-3-Clause
// Prints matching recall at equal precision of our band descriptor and OpenCV's, on pairs of views whose
// correspondences are known. Usage: lbd_recall [worlds]
#include <cstdio>
#include <cstdlib>

#include "../unit/line_recall.hpp"
#include "opencv_lbd.hpp"

namespace f = plumbline::features;

namespace {

void print_row(const char* name, const f::world::RecallMeter& ours, const f::world::RecallMeter& theirs) {
  std::printf("%-16s %6d", name, ours.possible());
  for (const double precision : {0.99, 0.95, 0.90}) {
    std::printf("   %5.3f %5.3f", ours.recall(precision), theirs.recall(precision));
  }
  std::printf("   %5.3f %5.3f\n", ours.precision(), theirs.precision());
}

}  // namespace

int main(int argc, char** argv) {
  const int worlds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 4;
  std::printf("recall of mutual nearest neighbours, ours | OpenCV %s\n", CV_VERSION);
  std::printf("%-16s %6s   %-11s   %-11s   %-11s   %s\n", "views", "lines", "at 99 %", "at 95 %", "at 90 %",
              "precision of all");
  f::world::RecallMeter all_ours;
  f::world::RecallMeter all_theirs;
  for (const f::world::ViewPair& pair : f::world::view_pairs()) {
    f::world::RecallMeter ours;
    f::world::RecallMeter theirs;
    for (int w = 0; w < worlds; ++w) {
      const auto [a, b] = f::world::make_views(pair, static_cast<std::uint32_t>(w + 1));
      for (f::world::RecallMeter* meter : {&ours, &all_ours}) meter->add(a, b, f::describe_lines);
      for (f::world::RecallMeter* meter : {&theirs, &all_theirs}) meter->add(a, b, f::benchmarks::opencv_lbd);
    }
    print_row(pair.name.c_str(), ours, theirs);
  }
  print_row("all", all_ours, all_theirs);
  return all_ours.recall(0.95) >= all_theirs.recall(0.95) ? 0 : 1;
}
