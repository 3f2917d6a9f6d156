// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Container of things named by core::Id: constant-time look-up, iteration in order of id.
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace plumbline::maps {

template <typename IdType, typename T>
class IdMap {
 public:
  [[nodiscard]] bool contains(IdType id) const { return find(id) != nullptr; }
  [[nodiscard]] const T* find(IdType id) const {
    const auto robot = slots_.find(id.robot);
    if (robot == slots_.end() || id.index < 0 || static_cast<std::size_t>(id.index) >= robot->second.size()) {
      return nullptr;
    }
    const auto& slot = robot->second[static_cast<std::size_t>(id.index)];
    return slot ? &*slot : nullptr;
  }
  [[nodiscard]] T* find(IdType id) { return const_cast<T*>(std::as_const(*this).find(id)); }
  [[nodiscard]] const T& at(IdType id) const {
    const T* found = find(id);
    if (found == nullptr) throw std::out_of_range("IdMap: no such id");
    return *found;
  }
  [[nodiscard]] T& at(IdType id) { return const_cast<T&>(std::as_const(*this).at(id)); }
  [[nodiscard]] std::size_t size() const { return size_; }

  /// The next unused id of a robot.
  [[nodiscard]] IdType next_id(std::int32_t robot) const {
    const auto found = slots_.find(robot);
    return {robot, found == slots_.end() ? 0 : static_cast<std::int32_t>(found->second.size())};
  }
  /// Inserts or replaces.
  void insert(IdType id, T value) {
    auto& slots = slots_[id.robot];
    if (static_cast<std::size_t>(id.index) >= slots.size())
      slots.resize(static_cast<std::size_t>(id.index) + 1);
    auto& slot = slots[static_cast<std::size_t>(id.index)];
    if (!slot) ++size_;
    slot = std::move(value);
  }
  void erase(IdType id) {
    if (!contains(id)) return;
    slots_[id.robot][static_cast<std::size_t>(id.index)].reset();
    --size_;
  }
  [[nodiscard]] std::vector<IdType> ids() const {
    std::vector<IdType> result;
    result.reserve(size_);
    for (const auto& [robot, slots] : slots_) {
      for (std::size_t i = 0; i < slots.size(); ++i) {
        if (slots[i]) result.push_back({robot, static_cast<std::int32_t>(i)});
      }
    }
    return result;
  }

 private:
  std::map<std::int32_t, std::vector<std::optional<T>>> slots_;
  std::size_t size_ = 0;
};

}  // namespace plumbline::maps
