// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/places/vocabulary.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "plumbline/places/majority.hpp"

namespace plumbline::places {

using features::Descriptor256;

namespace {

constexpr int kMaxBranching = 64;

std::size_t index_of(Word word) { return static_cast<std::size_t>(word); }

}  // namespace

void VocabularyOptions::declare(core::OptionTable& table) {
  table.integer("vocabulary.branching", branching, {2, kMaxBranching}, "",
                "Largest number of children of a node");
  table.integer("vocabulary.levels", levels, {1, 12}, "", "Largest number of levels of the tree");
  table.integer("vocabulary.split", split, {10, 100000}, "",
                "A word with more features than this is divided");
}

Vocabulary::Vocabulary(const VocabularyOptions& options) : options_(options) {
  options_.branching = std::clamp(options_.branching, 2, kMaxBranching);

  // A tree for points, and one for lines
  for (const Kind kind : kKinds) {
    Node root;
    root.kind = kind;
    root.divide_at = patience(0);
    nodes_.push_back(root);
    centres_.push_back({});
  }
}

std::int64_t Vocabulary::patience(int level) const {
  const int more = level == 0 ? 20 : level == 1 ? 5 : 1;
  return static_cast<std::int64_t>(options_.split) * more;
}

Word Vocabulary::word(Kind kind, const Descriptor256& descriptor) const {
  auto node = static_cast<Word>(kind);
  std::array<int, kMaxBranching> distances{};

  // Down the tree, always to the nearest centre
  while (nodes_[index_of(node)].children > 0) {
    const Node& n = nodes_[index_of(node)];
    const auto count = static_cast<std::size_t>(n.children);
    features::hamming_distances(descriptor, &centres_[index_of(n.first_child)], count, distances.data());
    const auto nearest = std::min_element(distances.begin(), distances.begin() + n.children);
    node = n.first_child + static_cast<Word>(nearest - distances.begin());
  }
  return node;
}

double Vocabulary::weight(Word word) const {
  const std::int64_t in_word = nodes_[index_of(word)].features;
  const std::int64_t all = nodes_[0].features + nodes_[1].features;
  if (in_word <= 0 || all <= in_word) return 0.0;
  return std::log(static_cast<double>(all) / static_cast<double>(in_word));
}

void Vocabulary::count(Word word) {
  Node& node = nodes_[index_of(word)];
  ++node.features;
  const auto root = static_cast<Word>(node.kind);
  if (root != word) ++nodes_[index_of(root)].features;
}

bool Vocabulary::overfull(Word word) const {
  const Node& node = nodes_[index_of(word)];
  return node.children == 0 && node.level < options_.levels && node.features > node.divide_at;
}

Word Vocabulary::add_children(Word parent, const std::vector<Descriptor256>& centres) {
  const auto first = static_cast<Word>(nodes_.size());
  for (const Descriptor256& centre : centres) {
    Node child;
    child.kind = nodes_[index_of(parent)].kind;
    child.level = static_cast<std::int8_t>(nodes_[index_of(parent)].level + 1);
    child.divide_at = patience(child.level);
    nodes_.push_back(child);
    centres_.push_back(centre);
  }

  // Children are consecutive nodes
  nodes_[index_of(parent)].first_child = first;
  nodes_[index_of(parent)].children = static_cast<std::int16_t>(centres.size());
  return first;
}

std::vector<Word> Vocabulary::divide(Word word, const std::vector<Descriptor256>& members) {
  if (!overfull(word)) throw std::logic_error("Vocabulary: this word is not overfull");

  const Clusters clusters =
      k_majority(members, options_.branching, options_.iterations, static_cast<std::uint64_t>(word));

  // Members too similar to divide: tried again later
  if (clusters.centres.size() < 2) {
    nodes_[index_of(word)].divide_at = 2 * nodes_[index_of(word)].features;
    return {};
  }

  // Every member moves to the child of its cluster
  const Word first = add_children(word, clusters.centres);
  std::vector<Word> words;
  words.reserve(members.size());
  for (const int c : clusters.member_of) {
    words.push_back(first + static_cast<Word>(c));
    ++nodes_[index_of(words.back())].features;
  }
  return words;
}

std::size_t Vocabulary::word_count(Kind kind) const {
  return static_cast<std::size_t>(std::count_if(
      nodes_.begin(), nodes_.end(), [&](const Node& n) { return n.kind == kind && n.children == 0; }));
}

std::int64_t Vocabulary::feature_count(Kind kind) const {
  return nodes_[static_cast<std::size_t>(kind)].features;
}

int Vocabulary::depth(Kind kind) const {
  int deepest = 0;
  for (const Node& n : nodes_) {
    if (n.kind == kind) deepest = std::max(deepest, static_cast<int>(n.level));
  }
  return deepest;
}

}  // namespace plumbline::places
