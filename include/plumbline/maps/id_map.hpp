// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Container of objects named by core::Id: constant-time look-up, iteration in order of id. An erased object
// leaves four bytes behind, so that a map does not grow with the length of a run although landmarks come and
// go. It records which pages of ids were changed lately, so that stores can follow at a cost that depends on
// the changes only.
#include <cstdint>
#include <deque>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

namespace plumbline::maps {

template <typename IdType, typename T>
class IdMap {
 public:
  [[nodiscard]] bool contains(IdType id) const { return entry_of(id) >= 0; }
  [[nodiscard]] const T* find(IdType id) const {
    const std::int32_t entry = entry_of(id);
    return entry < 0 ? nullptr : &pool_[static_cast<std::size_t>(entry)];
  }
  [[nodiscard]] T* find(IdType id) {
    T* found = const_cast<T*>(std::as_const(*this).find(id));
    if (found != nullptr) touch(id);
    return found;
  }
  [[nodiscard]] const T& at(IdType id) const {
    const T* found = find(id);
    if (found == nullptr) throw std::out_of_range("IdMap: no such id");
    return *found;
  }
  [[nodiscard]] T& at(IdType id) {
    T& found = const_cast<T&>(std::as_const(*this).at(id));
    touch(id);
    return found;
  }
  [[nodiscard]] std::size_t size() const { return pool_.size() - free_.size(); }

  /// The next unused id of a robot.
  [[nodiscard]] IdType next_id(std::int32_t robot) const {
    const auto found = slots_.find(robot);
    return {robot, found == slots_.end() ? 0 : static_cast<std::int32_t>(found->second.size())};
  }
  /// The same of every robot that has or had anything here.
  [[nodiscard]] std::vector<IdType> next_ids() const {
    std::vector<IdType> result;
    for (const auto& [robot, slots] : slots_)
      result.push_back({robot, static_cast<std::int32_t>(slots.size())});
    return result;
  }
  /// Ids of `next`'s robot before `next` count as used.
  void reserve(IdType next) {
    auto& slots = slots_[next.robot];
    if (next.index > 0 && static_cast<std::size_t>(next.index) > slots.size())
      slots.resize(static_cast<std::size_t>(next.index), kNone);
  }
  /// Inserts or replaces; the id must be valid. What other ids name stays where it is in memory.
  void insert(IdType id, T value) {
    if (id.index < 0) throw std::invalid_argument("IdMap: no valid id");
    if (T* found = find(id); found != nullptr) {
      *found = std::move(value);
      return;
    }
    reserve({id.robot, id.index + 1});
    std::int32_t& slot = slots_[id.robot][static_cast<std::size_t>(id.index)];
    if (free_.empty()) {
      slot = static_cast<std::int32_t>(pool_.size());
      pool_.push_back(std::move(value));
    } else {
      slot = free_.back();
      free_.pop_back();
      pool_[static_cast<std::size_t>(slot)] = std::move(value);
    }
    touch(id);
  }
  /// Frees the element; its page counts as changed.
  void erase(IdType id) {
    const std::int32_t entry = entry_of(id);
    if (entry < 0) return;
    pool_[static_cast<std::size_t>(entry)] = T{};  // gives its memory back
    free_.push_back(entry);
    touch(id);
    slots_[id.robot][static_cast<std::size_t>(id.index)] = kNone;
  }
  /// All ids in order of robot and index.
  [[nodiscard]] std::vector<IdType> ids() const {
    std::vector<IdType> result;
    result.reserve(size());
    for (const auto& [robot, slots] : slots_) {
      for (std::size_t i = 0; i < slots.size(); ++i) {
        if (slots[i] != kNone) result.push_back({robot, static_cast<std::int32_t>(i)});
      }
    }
    return result;
  }

  static constexpr std::int32_t kIdsPerPage = 64;
  /// (robot, index / kIdsPerPage)
  using Page = std::pair<std::int32_t, std::int32_t>;
  /// Number of times that anything was inserted, erased or given out to be changed.
  [[nodiscard]] std::uint64_t revision() const { return revision_; }
  /// Pages in which that happened after revision() was `since`, in order.
  [[nodiscard]] std::vector<Page> changed_pages(std::uint64_t since) const {
    std::vector<Page> pages;
    for (const auto& [robot, touched] : touched_) {
      for (std::size_t page = 0; page < touched.size(); ++page) {
        if (touched[page] > since) pages.emplace_back(robot, static_cast<std::int32_t>(page));
      }
    }
    return pages;
  }

 private:
  static constexpr std::int32_t kNone = -1;
  void touch(IdType id) {
    auto& pages = touched_[id.robot];
    const auto page = static_cast<std::size_t>(id.index / kIdsPerPage);
    if (page >= pages.size()) pages.resize(page + 1, 0);
    pages[page] = ++revision_;
  }
  [[nodiscard]] std::int32_t entry_of(IdType id) const {
    const auto robot = slots_.find(id.robot);
    if (robot == slots_.end() || id.index < 0 || static_cast<std::size_t>(id.index) >= robot->second.size()) {
      return kNone;
    }
    return robot->second[static_cast<std::size_t>(id.index)];
  }

  std::map<std::int32_t, std::vector<std::int32_t>> slots_;  ///< by id: entry of the pool
  std::deque<T> pool_;
  std::vector<std::int32_t> free_;  ///< entries of the pool
  /// Value of revision_ when each page was last touched.
  std::map<std::int32_t, std::vector<std::uint64_t>> touched_;
  std::uint64_t revision_ = 0;
};

}  // namespace plumbline::maps
