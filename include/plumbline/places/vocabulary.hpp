// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// The visual vocabulary (docs/method/places.md): one tree of words for points, one for lines; a leaf is a
// word. It grows with its input: a word that has become too common is divided, and nothing else changes.
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plumbline/core/options.hpp"
#include "plumbline/features/descriptor.hpp"

namespace plumbline::places {

/// Kind of a feature: points and lines have separate trees.
enum class Kind : std::uint8_t { kPoint = 0, kLine = 1 };
constexpr std::array<Kind, 2> kKinds{Kind::kPoint, Kind::kLine};

/// Index of a node of either tree; the leaves are the present words.
using Word = std::int32_t;

struct VocabularyOptions {
  int branching = 10;  ///< k: largest number of children of a node
  int levels = 6;      ///< d: largest depth of a word
  int split = 20;      ///< a word with more features than this is divided
  int iterations = 5;  ///< iterations of k-majority
  void declare(core::OptionTable& table);
};

class Vocabulary {
 public:
  /// Begins with one word for all points and one for all lines.
  explicit Vocabulary(const VocabularyOptions& options = {});

  /// The word of a descriptor: down the tree, to the nearest child at each level.
  [[nodiscard]] Word word(Kind kind, const features::Descriptor256& descriptor) const;
  /// log(N / n_w): N features in the dictionary, n_w of them in the word; 0 for a word never seen.
  [[nodiscard]] double weight(Word word) const;
  [[nodiscard]] bool is_word(Word node) const { return nodes_[static_cast<std::size_t>(node)].children == 0; }

  /// Counts one more feature in `word`.
  void count(Word word);
  /// True if the word has become so common that it should be divided. Words near the root wait for more
  /// features, because their decision is final.
  [[nodiscard]] bool overfull(Word word) const;
  /// Divides a word into children, seeded by its number; `members` are the descriptors of all its features.
  /// Returns the new word of each; empty if they do not differ enough (tried again when there are twice as
  /// many).
  std::vector<Word> divide(Word word, const std::vector<features::Descriptor256>& members);

  [[nodiscard]] std::size_t node_count() const { return nodes_.size(); }
  [[nodiscard]] std::size_t word_count(Kind kind) const;
  [[nodiscard]] std::int64_t feature_count(Kind kind) const;
  [[nodiscard]] int depth(Kind kind) const;  ///< depth of the deepest word; 0: the root is the only word

 private:
  struct Node {
    Word first_child = -1;
    std::int16_t children = 0;
    std::int8_t level = 0;
    Kind kind = Kind::kPoint;
    std::int64_t features = 0;   ///< number of features: n_w of a word; a root's count is its whole tree's
    std::int64_t divide_at = 0;  ///< number of features above which the word is divided
  };
  Word add_children(Word parent, const std::vector<features::Descriptor256>& centres);
  /// Number of features that a word of this level may have.
  [[nodiscard]] std::int64_t patience(int level) const;

  VocabularyOptions options_;
  std::vector<Node> nodes_;  ///< 0 and 1 are the roots; children of a node are consecutive
  std::vector<features::Descriptor256> centres_;  ///< centre of each node
};

}  // namespace plumbline::places
