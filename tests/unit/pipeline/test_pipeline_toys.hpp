// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Stages that add and multiply, to test graphs and their runs without cameras.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "plumbline/pipeline/graph.hpp"

namespace plumbline::pipeline::toys {

struct Total {
  std::string text;  ///< every number in the order it came
};

/// Shared by the stages of one test.
struct Bench {
  std::atomic<int> under_way{0};
  std::atomic<int> most_under_way{0};
  std::atomic<int> in_serial{0};
  std::atomic<int> tapped{0};
  std::string collected;
  bool collected_called = false;
};

class Count : public Stage {
 public:
  explicit Count(Bench& bench) : bench_(bench) {}
  void declare(core::OptionTable& table) override {
    table.integer("n", n_, {0, 100000}, "", "How many numbers");
  }
  [[nodiscard]] std::size_t frames() const override { return static_cast<std::size_t>(n_); }
  core::Result<void> process(StageIo& io) override {
    const int now = ++bench_.under_way;
    int most = bench_.most_under_way;
    while (now > most && !bench_.most_under_way.compare_exchange_weak(most, now)) {
    }
    io.output<int>("number", std::make_shared<int>(static_cast<int>(io.frame())));
    return {};
  }

 private:
  Bench& bench_;
  int n_ = 20;
};

class Scale : public Stage {
 public:
  void declare(core::OptionTable& table) override {
    table.integer("by", by_, {-9, 9}, "", "Factor");
    table.integer("fail_at", fail_at_, {-1, 100000}, "", "Number to fail at");
    table.integer("throw_at", throw_at_, {-1, 100000}, "", "Number to throw at");
    table.boolean("drop_odd", drop_odd_, "Give nothing for odd numbers");
    table.boolean("late", late_, "The earlier the later");
    table.text("file", file_, "A file that must exist; empty: none", core::EmptyValue::kAllowed);
  }
  void check(const CheckContext& context, const core::ConfigMark& mark, const std::string& path,
             core::ConfigProblems& problems) override {
    if (!file_.empty() && context.find(file_).empty())
      problems.push_back({mark, path + ".file", "no such file"});
  }
  core::Result<void> process(StageIo& io) override {
    const int number = *io.input<int>("number");
    if (late_) std::this_thread::sleep_for(std::chrono::microseconds(200 * (5 - number % 6)));
    if (number == fail_at_) return core::input_error(fmt::format("number {} is broken", number));
    if (number == throw_at_) throw std::runtime_error("thrown");
    if (drop_odd_ && number % 2 == 1) return {};
    io.output<int>("number", std::make_shared<int>(number * by_));
    return {};
  }

 private:
  int by_ = 2;
  int fail_at_ = -1;
  int throw_at_ = -1;
  bool drop_odd_ = false;
  bool late_ = false;
  std::string file_;
};

class Sum : public Stage {
 public:
  explicit Sum(Bench& bench) : bench_(bench) {}
  core::Result<void> process(StageIo& io) override {
    if (++bench_.in_serial != 1) throw std::logic_error("two at a time in a serial stage");
    total_.text += fmt::format("{} ", *io.input<int>("number"));
    if (const auto other = io.input<int>("other")) total_.text += fmt::format("+{} ", *other);
    --bench_.in_serial;
    --bench_.under_way;
    return {};
  }
  core::Result<void> finish(StageIo& io) override {
    io.output<Total>("total", std::make_shared<Total>(total_));
    return {};
  }

 private:
  Bench& bench_;
  Total total_;
};

class Collect : public Stage {
 public:
  explicit Collect(Bench& bench) : bench_(bench) {}
  void declare(core::OptionTable& table) override {
    table.text("writes", writes_, "A file it says to write; empty: none", core::EmptyValue::kAllowed);
  }
  [[nodiscard]] std::vector<std::string> files() const override { return {writes_}; }
  core::Result<void> process(StageIo& /*io*/) override { throw std::logic_error("has no frames"); }
  core::Result<void> finish(StageIo& io) override {
    bench_.collected = io.input<Total>("total")->text;
    bench_.collected_called = true;
    return {};
  }

 private:
  Bench& bench_;
  std::string writes_ = "total.txt";
};

/// A tap that counts what it is given.
class ToyTap : public Stage {
 public:
  explicit ToyTap(Bench& bench) : bench_(bench) {}
  void declare(core::OptionTable& table) override {
    table.text("file", file_, "A file it says to write; empty: none", core::EmptyValue::kAllowed);
  }
  [[nodiscard]] std::vector<std::string> files() const override { return {file_}; }
  core::Result<void> process(StageIo& io) override {
    bench_.tapped += *io.input<int>("in");
    return {};
  }

 private:
  Bench& bench_;
  std::string file_;
};

/// The same for what comes at the end.
class ToyEndTap : public ToyTap {
 public:
  using ToyTap::ToyTap;
  core::Result<void> process(StageIo& /*io*/) override { throw std::logic_error("has no frames"); }
};

inline void register_toys(StageRegistry& registry, Bench& bench) {
  const Port number{"number", port_type<int>("number"), true};
  const Port other{"other", port_type<int>("number"), false};
  const Port total{"total", port_type<Total>("total", Rate::kEnd), true};
  registry.add(
      {"count", "", Mode::kStateless, {}, {number}, [&bench] { return std::make_unique<Count>(bench); }});
  registry.add({"scale", "", Mode::kStateless, {number}, {number}, [] { return std::make_unique<Scale>(); }});
  registry.add({"sum", "", Mode::kSerial, {number, other}, {total}, [&bench] {
                  return std::make_unique<Sum>(bench);
                }});
  registry.add({"collect",
                "",
                Mode::kSerial,
                {total},
                {},
                [&bench] { return std::make_unique<Collect>(bench); },
                true});
  registry.add_tap({"number", "", Mode::kStateless, {{"in", number.type, true}}, {}, [&bench] {
                      return std::make_unique<ToyTap>(bench);
                    }});
  registry.add_tap({"total", "", Mode::kSerial, {{"in", total.type, true}}, {}, [&bench] {
                      return std::make_unique<ToyEndTap>(bench);
                    }});
}

}  // namespace plumbline::pipeline::toys
