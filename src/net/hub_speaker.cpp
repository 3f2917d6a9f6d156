// SPDX-License-Identifier: BSD-3-Clause
#include "hub_speaker.hpp"

#include <thread>

#include "plumbline/core/version.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::net {
namespace {

using namespace std::chrono_literals;

constexpr auto kSayAgain = 500ms;
constexpr auto kWhenStopped = 50ms;

}  // namespace

void HubSpeaker::say(Word word) const {
  word.store_format = maps::kStoreFormat;
  word.program = core::version();
  word.hub = id_;
  word.up_s = serving_since_ ? std::chrono::duration<double>(Clock::now() - *serving_since_).count() : -1.0;
  bus_.say(word);
}

bool HubSpeaker::say_presence() {
  if (Clock::now() - said_at_ < kSayAgain) return false;
  say({});
  said_at_ = Clock::now();
  return true;
}

void HubSpeaker::say_goodbye(const std::vector<Word>& words, const core::StopToken& stop) const {
  for (int i = 0; i < 10 || !stop.stop_requested(); ++i) {
    for (const Word& word : words) say(word);
    bus_.hear();
    std::this_thread::sleep_for(stop.stop_requested() ? kWhenStopped : kSayAgain / 2);
  }
}

}  // namespace plumbline::net
