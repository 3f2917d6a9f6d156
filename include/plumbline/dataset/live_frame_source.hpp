// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A recording that grows while it is read.
#include <chrono>
#include <cstddef>
#include <filesystem>

#include "plumbline/core/stop.hpp"
#include "plumbline/dataset/frame_source.hpp"

namespace plumbline::dataset {

/// Counts of a live source's images.
struct LiveReport {
  std::size_t taken = 0;       ///< frames
  std::size_t dropped = 0;     ///< frames that arrived while too many waited
  std::size_t backwards = 0;   ///< frames whose stamp was not later than the last one's
  std::size_t unpaired = 0;    ///< images of either kind without one of the other near them
  std::size_t lost = 0;        ///< messages that the network reported as lost
  std::size_t kept = 0;        ///< frames whose images were kept, to be read once more
  std::size_t kept_bytes = 0;  ///< of these, packed
};

/// Frames arrive while others are read: size() grows, and the final number of frames is not known. A frame
/// can be read from its arrival until it is released, and after that if it was kept. Thread-safe.
class LiveFrameSource : public FrameSource {
 public:
  /// True if frame `index` can be read, or if it is known that no such frame will come.
  [[nodiscard]] virtual bool decided(std::size_t index) const = 0;
  /// Waits, at most so long, until decided(index).
  virtual void wait_for(std::size_t index, std::chrono::milliseconds most) const = 0;
  /// True if frame `index`, which has been handed out, is the last one. Waits until that is known, or until
  /// `stop`: then it is false.
  [[nodiscard]] virtual bool is_last(std::size_t index, const core::StopToken& stop) const = 0;
  /// True if the result is not needed any more.
  [[nodiscard]] virtual bool given_up() const = 0;
  [[nodiscard]] virtual LiveReport report() const = 0;

  /// Work on frame `index` begins: it and those before it do not wait any more.
  virtual void hand_out(std::size_t index) = 0;
  /// Keeps frame `index`, which is not released yet, so that it can be read again.
  virtual void keep(std::size_t index) = 0;
  /// Frame `index` is no longer needed; it can be read again only if it was kept.
  virtual void release(std::size_t index) = 0;
  /// Sets the folder of the file for kept frames, which has no name and needs room. Without a folder they
  /// stay in memory.
  virtual void keep_in(const std::filesystem::path& folder) = 0;
  /// Ends the source and the files that it writes itself. Error (kOutput): the record.
  [[nodiscard]] virtual core::Result<void> finish() = 0;
};

}  // namespace plumbline::dataset
