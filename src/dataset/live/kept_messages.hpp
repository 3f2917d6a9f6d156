// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages in a temporary file without a name: keyframes of a long run are many, and seldom wanted again.
#include <cstdint>
#include <optional>

#include "bags/bag_file.hpp"

namespace plumbline::dataset {

class KeptMessages {
 public:
  struct Spot {
    std::uint64_t at = 0;
    std::size_t size = 0;
  };
  KeptMessages() = default;
  ~KeptMessages();
  KeptMessages(const KeptMessages&) = delete;
  KeptMessages& operator=(const KeptMessages&) = delete;

  /// None: there is no room in the folder of temporary files.
  std::optional<Spot> add(const Bytes& bytes);
  /// None: cannot be read.
  [[nodiscard]] std::optional<Bytes> read(const Spot& spot) const;

 private:
  int descriptor_ = -1;
  std::uint64_t end_ = 0;
};

}  // namespace plumbline::dataset
