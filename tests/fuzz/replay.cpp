// SPDX-License-Identifier: BSD-3-Clause
// A fuzz target as a quick, repeatable test with any compiler: every file of a folder, then mutations of
// them.
//   fuzz_ply_replay CORPUS-FOLDER MUTATIONS
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "fuzz_target.hpp"

namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

std::vector<Bytes> read_corpus(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<Bytes> corpus;
  for (const fs::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    corpus.emplace_back(std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>());
  }
  return corpus;
}

/// One random change: a byte, a number's digit, a stretch taken out, doubled or taken from another input.
void mutate(Bytes& input, const std::vector<Bytes>& corpus, std::mt19937& random) {
  const auto below = [&random](std::size_t n) { return n == 0 ? 0 : random() % n; };
  const auto at = [&input](std::size_t i) { return input.begin() + static_cast<std::ptrdiff_t>(i); };
  const std::size_t place = below(input.size());
  const std::size_t length = std::min<std::size_t>(1 + below(16), input.size() - place);
  switch (random() % 5) {
    case 0:
      if (!input.empty()) input[place] = static_cast<std::uint8_t>(random());
      break;
    case 1: {
      const auto digit = std::find_if(at(place), input.end(), [](auto c) { return c >= '0' && c <= '9'; });
      if (digit != input.end()) *digit = static_cast<std::uint8_t>('0' + random() % 10);
      break;
    }
    case 2:
      input.erase(at(place), at(place + length));
      break;
    case 3: {
      const Bytes piece(at(place), at(place + length));
      input.insert(at(place), piece.begin(), piece.end());
      break;
    }
    default: {
      const Bytes& other = corpus[below(corpus.size())];
      const std::size_t from = below(other.size());
      const std::size_t end = std::min(other.size(), from + 1 + below(64));
      input.insert(at(place), other.begin() + static_cast<std::ptrdiff_t>(from),
                   other.begin() + static_cast<std::ptrdiff_t>(end));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::vector<Bytes> corpus = read_corpus(argv[1]);
  const int mutations = std::atoi(argv[2]);
  if (corpus.empty() || mutations < 1) return 2;
  for (const Bytes& input : corpus) LLVMFuzzerTestOneInput(input.data(), input.size());
  std::mt19937 random(1);
  for (int i = 0; i < mutations; ++i) {
    Bytes input = corpus[random() % corpus.size()];
    for (auto changes = 1 + random() % 4; changes > 0; --changes) mutate(input, corpus, random);
    const auto start = std::chrono::steady_clock::now();
    LLVMFuzzerTestOneInput(input.data(), input.size());
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
    plumbline::fuzz::require(spent.count() < 10.0, "no input takes seconds");
  }
  std::printf("%zu files and %d mutations: nothing broke\n", corpus.size(), mutations);
}
