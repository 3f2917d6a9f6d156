// SPDX-License-Identifier: BSD-3-Clause
// A hub that speaks without a pause and never takes anything: flood_words INTERFACE ROBOT SECONDS. Prints how
// many words it said.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>

#include "bus.hpp"
#include "plumbline/maps/store.hpp"

int main(int argc, char** argv) {
  using namespace plumbline;
  if (argc != 4) return 2;
  net::NetworkOptions options;
  options.interface = argv[1];
  auto bus = net::open_hub_bus(options, {});
  if (!bus) {
    fmt::print(stderr, "flood_words: {}\n", bus.error().message);
    return static_cast<int>(bus.error().kind);
  }
  net::Word word;
  word.store_format = maps::kStoreFormat;
  word.hub = "0123456789abcdef";
  word.robot = argv[2];
  word.answer = net::Answer::kTrouble;
  word.problem = std::string(400, '-');
  std::uint64_t said = 0;
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(argv[3]));
  for (; std::chrono::steady_clock::now() < until; ++said) (*bus)->say(word);
  fmt::print("{} words\n", said);
}
