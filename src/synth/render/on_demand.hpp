// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Values that are made when a picture first needs them. Private to the module.
#include <atomic>
#include <functional>
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

}  // namespace plumbline::synth
