// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/mapping/loop_closing/consistent_pairs.hpp"

#include <algorithm>
#include <numeric>
#include <set>

namespace plumbline::mapping {
namespace {

using core::KeyframeId;
using geometry::Rigid3;

Rigid3 between(const maps::Map& map, KeyframeId from, KeyframeId to) {
  return map.camera_from_world(to) * map.camera_from_world(from).inverse();
}

Eigen::Vector3d centre(const maps::Map& map, KeyframeId id) {
  return map.camera_from_world(id).inverse().translation;
}

/// Branch and bound; the number of colours needed to paint the rest bounds how much it can add (Tomita and
/// Seki 2003).
class CliqueSearch {
 public:
  CliqueSearch(const std::vector<std::vector<bool>>& joined, int budget) : joined_(joined), budget_(budget) {}

  std::vector<std::size_t> run() {
    std::vector<std::size_t> all(joined_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::vector<std::size_t> degree(all.size());
    for (const std::size_t i : all) {
      degree[i] = static_cast<std::size_t>(std::count(joined_[i].begin(), joined_[i].end(), true));
    }
    std::stable_sort(all.begin(), all.end(),
                     [&](std::size_t a, std::size_t b) { return degree[a] > degree[b]; });
    grow(all);
    std::sort(best_.begin(), best_.end());
    return best_;
  }

 private:
  /// `rest`: nodes that are joined with every node in current_.
  void grow(const std::vector<std::size_t>& rest) {
    if (current_.size() > best_.size()) best_ = current_;
    std::vector<std::size_t> order;
    std::vector<std::size_t> colours;
    paint(rest, order, colours);
    for (std::size_t i = order.size(); i-- > 0;) {
      if (current_.size() + colours[i] <= best_.size() || --budget_ < 0) return;
      const std::size_t chosen = order[i];
      std::vector<std::size_t> left;
      for (std::size_t j = 0; j < i; ++j) {
        if (joined_[chosen][order[j]]) left.push_back(order[j]);
      }
      current_.push_back(chosen);
      grow(left);
      current_.pop_back();
    }
  }
  /// Classes of which no two are joined; `colours` counts the classes up to each one of `order`.
  void paint(const std::vector<std::size_t>& rest, std::vector<std::size_t>& order,
             std::vector<std::size_t>& colours) const {
    // Greedy colouring: a clique has at most one node of each class, so the
    // number of classes bounds its size.
    std::vector<std::vector<std::size_t>> classes;

    for (const std::size_t v : rest) {
      const auto free = std::find_if(classes.begin(), classes.end(), [&](const auto& c) {
        return std::none_of(c.begin(), c.end(), [&](std::size_t w) { return joined_[v][w]; });
      });
      if (free == classes.end()) {
        classes.push_back({v});
      } else {
        free->push_back(v);
      }
    }

    // Listed class by class, the bounds ascend, so the search ends at the first node that
    // cannot improve the best clique.
    for (std::size_t c = 0; c < classes.size(); ++c) {
      for (const std::size_t v : classes[c]) {
        order.push_back(v);
        colours.push_back(c + 1);
      }
    }
  }

  const std::vector<std::vector<bool>>& joined_;
  int budget_;
  std::vector<std::size_t> current_;
  std::vector<std::size_t> best_;
};

double span(const maps::Map& map, const std::vector<KeyframeId>& ids) {
  double result = 0.0;
  for (const KeyframeId a : ids) {
    for (const KeyframeId b : ids) result = std::max(result, (centre(map, a) - centre(map, b)).norm());
  }
  return result;
}

std::size_t different(const std::vector<KeyframeId>& ids) {
  return std::set<KeyframeId>(ids.begin(), ids.end()).size();
}

ConsistentSet describe(const maps::Map& map_a, const maps::Map& map_b, const std::vector<PlacePair>& pairs,
                       std::vector<std::size_t> members) {
  ConsistentSet result;
  std::vector<KeyframeId> a;
  std::vector<KeyframeId> b;
  for (const std::size_t i : members) {
    a.push_back(pairs[i].a);
    b.push_back(pairs[i].b);
  }
  result.members = std::move(members);
  result.keyframes_a = different(a);
  result.keyframes_b = different(b);
  result.span_m = std::min(span(map_a, a), span(map_b, b));
  return result;
}

}  // namespace

bool agree(const maps::Map& map_a, const maps::Map& map_b, const PlacePair& one, const PlacePair& two,
           const ConsistencyOptions& options) {
  const double apart = (centre(map_a, one.a) - centre(map_a, two.a)).norm();
  const double max_m = options.max_apart_m + options.apart_per_metre * apart;
  const double max_rad = options.max_turned_rad + options.turned_per_metre * apart;
  const auto fits = [&](const PlacePair& from, const PlacePair& at) {
    const Rigid3 by_way = between(map_b, from.b, at.b) * from.b_from_a * between(map_a, at.a, from.a);
    const Rigid3 difference = by_way * at.b_from_a.inverse();
    // Both pairs must give the same pose of a's camera in b.
    return (by_way.translation - at.b_from_a.translation).norm() <= max_m &&
           geometry::rotation_angle(difference.rotation) <= max_rad;
  };
  return fits(one, two) && fits(two, one);
}

std::vector<std::size_t> maximum_clique(const std::vector<std::vector<bool>>& joined, int budget) {
  return CliqueSearch(joined, budget).run();
}

std::vector<ConsistentSet> consistent_sets(const maps::Map& map_a, const maps::Map& map_b,
                                           const std::vector<PlacePair>& pairs,
                                           const ConsistencyOptions& options) {
  const std::size_t n = pairs.size();
  std::vector<std::vector<bool>> agreed(n, std::vector<bool>(n, false));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      agreed[i][j] = agreed[j][i] = agree(map_a, map_b, pairs[i], pairs[j], options);
    }
  }

  std::vector<ConsistentSet> sets;
  std::vector<std::size_t> left(n);
  std::iota(left.begin(), left.end(), std::size_t{0});

  while (!left.empty() && sets.size() < options.max_sets) {
    // The largest set of pairs that all agree with one another is a maximum clique of their graph.
    std::vector<std::vector<bool>> joined(left.size(), std::vector<bool>(left.size()));
    for (std::size_t i = 0; i < left.size(); ++i) {
      for (std::size_t j = 0; j < left.size(); ++j) joined[i][j] = agreed[left[i]][left[j]];
    }

    std::vector<std::size_t> members;
    for (const std::size_t i : maximum_clique(joined, options.budget)) members.push_back(left[i]);

    // A pair that agrees with half of the set is of the same alignment, up to noise,
    // and must not support a rival one.
    const auto agrees = [&](std::size_t i) {
      std::size_t count = 0;
      for (const std::size_t m : members) count += m == i || agreed[i][m] ? 1U : 0U;
      return std::find(members.begin(), members.end(), i) != members.end() || 2 * count >= members.size();
    };

    left.erase(std::remove_if(left.begin(), left.end(), agrees), left.end());
    sets.push_back(describe(map_a, map_b, pairs, std::move(members)));
  }

  return sets;
}

}  // namespace plumbline::mapping
