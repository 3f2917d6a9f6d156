// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/places/database.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace plumbline::places {

using core::KeyframeId;
using features::FrameFeatures;

namespace {

constexpr int kMaxDivisions = 60;      // of words, a keyframe
constexpr std::size_t kCommon = 4000;  // a word in more features than this does not discriminate
constexpr double kGrowthToReweigh = 1.25;

std::size_t at(std::int32_t i) { return static_cast<std::size_t>(i); }

}  // namespace

const features::Descriptor256& Database::descriptor(Kind kind, const Entry& entry) const {
  const FrameFeatures& features = *seen_[at(entry.slot)].features;
  return kind == Kind::kPoint ? features.descriptors[at(entry.feature)]
                              : features.lines[at(entry.feature)].descriptor;
}

void Database::make_room() {
  index_.resize(vocabulary_.node_count());
  weights_.resize(vocabulary_.node_count(), 0.0);
  kinds_.resize(vocabulary_.node_count(), Kind::kPoint);
}

void Database::file(Kind kind, const features::Descriptor256& descriptor, const Entry& entry) {
  const Word word = vocabulary_.word(kind, descriptor);
  kinds_[at(word)] = kind;
  index_[at(word)].push_back(entry);
  seen_[at(entry.slot)].mass += weights_[at(word)];

  // Listed once, on becoming overfull
  const bool before = vocabulary_.overfull(word);
  vocabulary_.count(word);
  if (!before && vocabulary_.overfull(word)) overfull_.push_back(word);
}

void Database::add(KeyframeId id, std::shared_ptr<const FrameFeatures> features) {
  if (!id.valid() || features == nullptr) throw std::invalid_argument("Database: no keyframe");
  if (contains(id)) throw std::invalid_argument("Database: the keyframe is there already");
  const auto slot = static_cast<std::int32_t>(keyframes_.size());
  slots_.insert(id, slot);
  keyframes_.push_back(id);
  seen_.push_back({features, 0.0});
  make_room();

  // Each feature under its word
  for (std::size_t i = 0; i < features->descriptors.size(); ++i) {
    file(Kind::kPoint, features->descriptors[i], {slot, static_cast<std::int32_t>(i)});
  }
  for (std::size_t i = 0; i < features->lines.size(); ++i) {
    file(Kind::kLine, features->lines[i].descriptor, {slot, static_cast<std::int32_t>(i)});
  }
  divide_overfull();

  // Weights change slowly: again only after much growth
  const std::int64_t features_now =
      vocabulary_.feature_count(Kind::kPoint) + vocabulary_.feature_count(Kind::kLine);
  if (static_cast<double>(features_now) >= kGrowthToReweigh * static_cast<double>(weighed_at_)) reweigh();
}

void Database::divide_overfull() {
  int divisions = 0;

  // A few at a time: adding a keyframe stays fast
  std::size_t next = 0;
  for (; next < overfull_.size() && divisions < kMaxDivisions; ++next) {
    if (!vocabulary_.overfull(overfull_[next])) continue;
    divide(overfull_[next]);
    ++divisions;
  }
  overfull_.erase(overfull_.begin(), overfull_.begin() + static_cast<std::ptrdiff_t>(next));
}

void Database::divide(Word word) {
  const Kind kind = kinds_[at(word)];
  const std::vector<Entry> entries = index_[at(word)];
  std::vector<features::Descriptor256> members;
  members.reserve(entries.size());
  for (const Entry& e : entries) members.push_back(descriptor(kind, e));

  const std::vector<Word> words = vocabulary_.divide(word, members);
  if (words.empty()) return;

  // The new words take the entries of the divided one
  make_room();
  const double old_weight = weights_[at(word)];
  index_[at(word)] = {};

  for (std::size_t i = 0; i < entries.size(); ++i) {
    const auto child = at(words[i]);
    if (index_[child].empty()) {
      kinds_[child] = kind;
      weights_[child] = vocabulary_.weight(words[i]);
      if (vocabulary_.overfull(words[i])) overfull_.push_back(words[i]);
    }

    // The feature and its mass move to the new word
    index_[child].push_back(entries[i]);
    seen_[at(entries[i].slot)].mass += weights_[child] - old_weight;
  }
}

void Database::reweigh() {
  make_room();
  weighed_at_ = vocabulary_.feature_count(Kind::kPoint) + vocabulary_.feature_count(Kind::kLine);
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    weights_[w] = vocabulary_.is_word(static_cast<Word>(w)) ? vocabulary_.weight(static_cast<Word>(w)) : 0.0;
  }

  // A keyframe's mass is the sum of its weights
  for (Seen& seen : seen_) seen.mass = 0.0;
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    for (const Entry& e : index_[w]) seen_[at(e.slot)].mass += weights_[w];
  }
}

Database::Scores Database::query(const FrameFeatures& image) const {
  Scores result;
  result.database_ = this;
  result.scores_.assign(keyframes_.size(), 0.0F);
  result.votes_ = result.scores_;
  std::vector<Word> words;
  words.reserve(image.descriptors.size() + image.lines.size());

  // The image as a vector of weighted words
  for (const auto& d : image.descriptors) words.push_back(vocabulary_.word(Kind::kPoint, d));
  for (const auto& l : image.lines) words.push_back(vocabulary_.word(Kind::kLine, l.descriptor));
  std::sort(words.begin(), words.end());
  double mass = 0.0;
  for (const Word w : words) mass += weights_[at(w)];
  if (!(mass > 0.0)) return result;

  // s = 1 - 1/2 |a - b|_1 of two vectors of norm 1 without negative entries is the sum of min(a_w, b_w).
  for (auto first = words.begin(); first != words.end();) {
    const auto last = std::upper_bound(first, words.end(), *first);
    const double weight = weights_[at(*first)];
    const double share = static_cast<double>(last - first) * weight / mass;
    const std::vector<Entry>& entries = index_[at(*first)];
    first = last;
    if (!(weight > 0.0) || entries.size() > kCommon) continue;

    // Sum of the smaller share of each common word
    for (std::size_t i = 0; i < entries.size();) {
      const std::int32_t slot = entries[i].slot;
      const std::size_t begin = i;
      while (i < entries.size() && entries[i].slot == slot) ++i;
      const double theirs = static_cast<double>(i - begin) * weight / seen_[at(slot)].mass;
      result.scores_[at(slot)] += static_cast<float>(std::min(share, theirs));
      result.votes_[at(slot)] += 1.0F;
    }
  }

  return result;
}

double Database::Scores::of(KeyframeId id) const {
  const std::int32_t* slot = database_->slots_.find(id);
  return slot == nullptr || at(*slot) >= scores_.size() ? 0.0 : static_cast<double>(scores_[at(*slot)]);
}

std::vector<Hit> Database::Scores::best(std::size_t count, const std::function<bool(KeyframeId)>& allowed,
                                        bool by_votes) const {
  const std::vector<float>& ranks = by_votes ? votes_ : scores_;
  std::vector<std::int32_t> slots;
  for (std::size_t i = 0; i < scores_.size(); ++i) {
    if (scores_[i] > 0.0F) slots.push_back(static_cast<std::int32_t>(i));
  }

  // `allowed` may be expensive: it is called only for the best candidates, a block at a time.
  const auto better = [&](std::int32_t a, std::int32_t b) {
    return std::make_pair(-ranks[at(a)], a) < std::make_pair(-ranks[at(b)], b);
  };

  std::vector<Hit> hits;
  auto sorted = slots.begin();

  while (hits.size() < count && sorted != slots.end()) {
    const auto block =
        std::min<std::ptrdiff_t>(slots.end() - sorted, static_cast<std::ptrdiff_t>(2 * count + 16));
    std::partial_sort(sorted, sorted + block, slots.end(), better);

    for (const auto end = sorted + block; sorted != end; ++sorted) {
      const KeyframeId id = database_->keyframes_[at(*sorted)];
      if (hits.size() < count && (!allowed || allowed(id))) {
        hits.push_back({id, static_cast<double>(scores_[at(*sorted)])});
      }
    }
  }

  std::stable_sort(hits.begin(), hits.end(), [](const Hit& a, const Hit& b) { return a.score > b.score; });
  return hits;
}

}  // namespace plumbline::places
