// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Keyframes by appearance (docs/method/places.md): image vectors over the words of a vocabulary, an inverted
// index that votes, and a vocabulary that keeps learning from added keyframes.
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "plumbline/core/ids.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/maps/id_map.hpp"
#include "plumbline/places/vocabulary.hpp"

namespace plumbline::places {

/// One keyframe and its similarity to the query.
struct Hit {
  core::KeyframeId keyframe;
  double score = 0.0;  ///< s of docs/method/places.md: 0 nothing in common, 1 the same
};

/// Keyframes of any number of robots. The vocabulary is divided while keyframes are added: a fixed number of
/// words per keyframe at most, each of a bounded number of features, so that the cost of a keyframe does not
/// grow with their number. Vectors of earlier keyframes are updated at once (their features move to the new
/// words); the weights log(N / n_w) are recomputed whenever the dictionary has grown by a quarter. The result
/// depends only on the order in which keyframes were added.
class Database {
 public:
  explicit Database(Vocabulary vocabulary) : vocabulary_(std::move(vocabulary)) { reweigh(); }

  /// Adds a keyframe once (throws std::invalid_argument the second time). The features are kept.
  void add(core::KeyframeId id, std::shared_ptr<const features::FrameFeatures> features);
  [[nodiscard]] bool contains(core::KeyframeId id) const { return slots_.contains(id); }
  [[nodiscard]] std::size_t size() const { return keyframes_.size(); }

  /// Scores of an image against every keyframe that shares words with it.
  class Scores {
   public:
    [[nodiscard]] double of(core::KeyframeId id) const;
    /// The best `count` among those that `allowed` lets pass, best first, ties by order of adding; no zeros.
    /// `by_votes`: the `count` that share most words, in order of their scores.
    [[nodiscard]] std::vector<Hit> best(std::size_t count,
                                        const std::function<bool(core::KeyframeId)>& allowed,
                                        bool by_votes = false) const;

   private:
    friend class Database;
    const Database* database_ = nullptr;
    std::vector<float> scores_;  ///< by order of adding
    std::vector<float> votes_;   ///< words in common
  };
  /// Valid until the next add.
  [[nodiscard]] Scores query(const features::FrameFeatures& image) const;

  [[nodiscard]] const Vocabulary& vocabulary() const { return vocabulary_; }

 private:
  struct Entry {
    std::int32_t slot = -1;
    std::int32_t feature = -1;
  };
  struct Seen {
    std::shared_ptr<const features::FrameFeatures> features;
    double mass = 0.0;  ///< sum of its features' weights: n_d times the vector's L1 norm
  };
  [[nodiscard]] const features::Descriptor256& descriptor(Kind kind, const Entry& entry) const;
  void file(Kind kind, const features::Descriptor256& descriptor, const Entry& entry);
  void divide_overfull();
  void divide(Word word);
  void make_room();
  void reweigh();

  Vocabulary vocabulary_;
  std::vector<core::KeyframeId> keyframes_;  ///< by slot
  std::vector<Seen> seen_;                   ///< by slot
  maps::IdMap<core::KeyframeId, std::int32_t> slots_;
  std::vector<std::vector<Entry>> index_;  ///< by word; slots ascend
  std::vector<Kind> kinds_;                ///< by word
  std::vector<double> weights_;            ///< by word, of the last time they were taken
  std::int64_t weighed_at_ = 0;            ///< features in the dictionary then
  std::vector<Word> overfull_;             ///< to be divided, in the order in which they became so
};

}  // namespace plumbline::places
