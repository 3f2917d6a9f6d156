// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// While this lives, the heap is full of holes of all sizes, so that what is allocated next lies in another
// order than it would.
#include <memory>
#include <vector>

#include "random_world.hpp"

namespace plumbline::tests {

class ShuffledHeap {
 public:
  explicit ShuffledHeap(std::uint32_t seed) {
    Random random(seed);
    for (int i = 0; i < 20000; ++i)
      blocks_.push_back(std::make_unique<char[]>(static_cast<std::size_t>(random.integer(8, 4000))));
    for (std::unique_ptr<char[]>& block : blocks_) {
      if (random.integer(0, 1) == 0) block.reset();
    }
  }

 private:
  std::vector<std::unique_ptr<char[]>> blocks_;
};

}  // namespace plumbline::tests
