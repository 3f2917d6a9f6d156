// SPDX-License-Identifier: BSD-3-Clause
#include "filters/parallel_search.hpp"

#include <algorithm>

namespace plumbline::cloud {
namespace {

constexpr std::size_t kBlock = 16384;  ///< points answered at a time: a few MB
constexpr std::size_t kPiece = 256;    ///< points that one thread takes at a time

}  // namespace

ParallelSearch::ParallelSearch(const core::Executor* executor, bool sorted)
    : pcl::search::KdTree<Point>(sorted), executor_(executor) {}

void ParallelSearch::for_each(std::size_t count, const std::function<void(std::size_t)>& body) const {
  const auto piece = [&](std::size_t p) {
    const std::size_t end = std::min(count, (p + 1) * kPiece);
    for (std::size_t i = p * kPiece; i < end; ++i) body(i);
  };
  const std::size_t pieces = (count + kPiece - 1) / kPiece;
  if (executor_ != nullptr && pieces > 1) {
    executor_->parallel_for(pieces, piece);
  } else {
    for (std::size_t p = 0; p < pieces; ++p) piece(p);
  }
}

void ParallelSearch::fill(std::size_t begin, int k) const {
  const auto width = static_cast<std::size_t>(k);
  block_.begin = begin;
  block_.end = std::min(begin + kBlock, input_->size());
  block_.k = k;
  const std::size_t count = block_.end - begin;
  block_.found.assign(count, 0);
  block_.indices.resize(count * width);
  block_.squared.resize(count * width);
  for_each(count, [&](std::size_t i) {
    thread_local pcl::Indices indices;
    thread_local std::vector<float> squared;
    const Point& p = (*input_)[begin + i];
    block_.found[i] = pcl::search::KdTree<Point>::nearestKSearch(p, k, indices, squared);
    const auto found = static_cast<std::ptrdiff_t>(std::clamp(block_.found[i], 0, k));
    std::copy_n(indices.begin(), found, block_.indices.begin() + static_cast<std::ptrdiff_t>(i * width));
    std::copy_n(squared.begin(), found, block_.squared.begin() + static_cast<std::ptrdiff_t>(i * width));
  });
}

int ParallelSearch::nearestKSearch(pcl::index_t index, int k, pcl::Indices& indices,
                                   std::vector<float>& squared_distances) const {
  const auto asked = static_cast<std::size_t>(index);
  if (executor_ == nullptr || executor_->threads() < 2) {
    return pcl::search::KdTree<Point>::nearestKSearch((*input_)[asked], k, indices, squared_distances);
  }
  if (k != block_.k || asked < block_.begin || asked >= block_.end) fill(asked, k);
  const std::size_t i = asked - block_.begin;
  const auto first = static_cast<std::ptrdiff_t>(i * static_cast<std::size_t>(k));
  const int found = block_.found[i];
  indices.assign(block_.indices.begin() + first, block_.indices.begin() + first + found);
  squared_distances.assign(block_.squared.begin() + first, block_.squared.begin() + first + found);
  return found;
}

int ParallelSearch::nearestKSearch(const PointCloud& cloud, pcl::index_t index, int k, pcl::Indices& indices,
                                   std::vector<float>& squared_distances) const {
  if (&cloud == input_.get()) return nearestKSearch(index, k, indices, squared_distances);
  return pcl::search::KdTree<Point>::nearestKSearch(cloud, index, k, indices, squared_distances);
}

}  // namespace plumbline::cloud
