// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Memory that work done side by side takes up once, not for every piece of it.
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace plumbline::cloud {

/// As many rooms as are in use at a time; what was left in one is still there when it is taken again.
template <typename T>
class Rooms {
 public:
  /// Goes back when it is destroyed.
  class Room {
   public:
    explicit Room(Rooms& rooms, std::unique_ptr<T> what) : rooms_(rooms), what_(std::move(what)) {}
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    ~Room() {
      const std::lock_guard<std::mutex> lock(rooms_.mutex_);
      rooms_.free_.push_back(std::move(what_));
    }
    T& operator*() const { return *what_; }
    T* operator->() const { return what_.get(); }

   private:
    Rooms& rooms_;
    std::unique_ptr<T> what_;
  };

  [[nodiscard]] Room take() {
    std::unique_ptr<T> what;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!free_.empty()) {
        what = std::move(free_.back());
        free_.pop_back();
      }
    }
    return Room(*this, what ? std::move(what) : std::make_unique<T>());
  }
  /// Gives memory back that nobody uses.
  void clear() {
    const std::lock_guard<std::mutex> lock(mutex_);
    free_.clear();
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> free_;
};

}  // namespace plumbline::cloud
