// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Values that are made when a picture first needs them. Private to the module.
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace plumbline::synth {

/// A list whose values any thread makes once, each a pure function of its index.
template <typename Value>
class OnDemand {
 public:
  void prepare(std::size_t count, std::function<Value(std::size_t)> make) {
    slots_ = std::vector<Slot>(count);
    make_ = std::move(make);
  }
  [[nodiscard]] const Value& operator[](std::size_t index) const {
    Slot& slot = slots_[index];
    if (!slot.ready.load(std::memory_order_acquire)) fill(slot, index);
    return slot.value;
  }

 private:
  struct Slot {
    std::once_flag once;
    std::atomic<bool> ready{false};
    Value value;
  };
  void fill(Slot& slot, std::size_t index) const {
    std::call_once(slot.once, [&] {
      slot.value = make_(index);
      slot.ready.store(true, std::memory_order_release);
    });
  }
  mutable std::vector<Slot> slots_;
  std::function<Value(std::size_t)> make_;
};

/// The same for values that take much memory: the least recently used ones are dropped, and made
/// again if need be.
template <typename Value>
class Recent {
 public:
  /// `most`: bytes of all values; `size`: of one.
  void prepare(std::size_t count, std::function<Value(std::size_t)> make,
               std::function<std::size_t(const Value&)> size, std::size_t most) {
    slots_ = std::vector<Slot>(count);
    make_ = std::move(make);
    size_ = std::move(size);
    most_ = most;
  }
  [[nodiscard]] std::shared_ptr<const Value> operator[](std::size_t index) const {
    Slot& slot = slots_[index];
    {
      const std::lock_guard lock(mutex_);
      slot.asked = ++clock_;
      if (slot.value) return slot.value;
    }

    auto made = std::make_shared<const Value>(make_(index));  // perhaps by two threads, which make the same
    const std::lock_guard lock(mutex_);
    if (!slot.value) bytes_ += size_(*made);
    slot.value = made;

    // The least recently used values make room.
    while (bytes_ > most_) {
      Slot* oldest = nullptr;
      for (Slot& other : slots_) {
        if (other.value && &other != &slot && (oldest == nullptr || other.asked < oldest->asked))
          oldest = &other;
      }

      // The new value alone may exceed the limit.
      if (oldest == nullptr) break;
      bytes_ -= size_(*oldest->value);
      oldest->value.reset();
    }
    return made;
  }

 private:
  struct Slot {
    std::shared_ptr<const Value> value;
    std::uint64_t asked = 0;
  };
  mutable std::mutex mutex_;
  mutable std::vector<Slot> slots_;
  mutable std::uint64_t clock_ = 0;
  mutable std::size_t bytes_ = 0;
  std::function<Value(std::size_t)> make_;
  std::function<std::size_t(const Value&)> size_;
  std::size_t most_ = 0;
};

}  // namespace plumbline::synth
