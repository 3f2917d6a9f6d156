// SPDX-License-Identifier: BSD-3-Clause
// plumbline vocabulary train INPUT... -o FILE, plumbline vocabulary info FILE
#include <fmt/format.h>

#include <memory>
#include <vector>

#include "app.hpp"
#include "plumbline/dataset/frame_source.hpp"
#include "plumbline/features/frame_features.hpp"
#include "plumbline/pipeline/input.hpp"
#include "plumbline/places/vocabulary.hpp"

namespace plumbline::cli {
namespace {

struct TrainRequest {
  std::vector<std::string> inputs;
  std::filesystem::path output;
  dataset::OpenOptions open;
  std::size_t every = 10;
  places::VocabularyOptions options;
};

struct Descriptors {
  std::vector<features::Descriptor256> points;
  std::vector<features::Descriptor256> lines;
};

/// Features of every n-th frame, in order of the frames whatever the number of threads.
core::Result<void> collect(const std::string& input, const TrainRequest& request, Session& session,
                           Descriptors& descriptors) {
  const auto pipelines = session.pipelines_folder();
  if (!pipelines) return tl::unexpected<core::Error>(pipelines.error());
  Console& console = session.console();
  dataset::OpenOptions open = request.open;
  open.cameras_folder = *pipelines / "cameras";
  const auto source = pipeline::open_input(input, open, *pipelines / "scenes", session.executor(), console);
  if (!source) return tl::unexpected<core::Error>(source.error());
  const features::FeatureExtractor extractor({}, (*source)->camera().color);
  constexpr std::size_t kChunk = 16;  // frames in memory
  const std::size_t frames = ((*source)->size() + request.every - 1) / request.every;
  for (std::size_t begin = 0; begin < frames; begin += kChunk) {
    std::vector<features::FrameFeatures> chunk(std::min(kChunk, frames - begin));
    session.executor().parallel_for(chunk.size(), [&](std::size_t i) {
      const auto frame = (*source)->read((begin + i) * request.every);
      if (frame) chunk[i] = extractor.extract(*frame);  // an unreadable frame teaches nothing
    });
    for (const features::FrameFeatures& f : chunk) {
      descriptors.points.insert(descriptors.points.end(), f.descriptors.begin(), f.descriptors.end());
      for (const features::LineFeature& l : f.lines) descriptors.lines.push_back(l.descriptor);
    }
    console.progress(begin + chunk.size(), frames, "frames");
  }
  console.end_progress();
  return {};
}

void print(const places::Vocabulary& vocabulary) {
  const places::VocabularyOptions& o = vocabulary.options();
  fmt::print("branching: {}\nlevels: {}\nfixed: {}\n", o.branching, o.levels,
             vocabulary.fixed() ? "yes" : "no, it goes on learning");
  for (const places::Kind kind : places::kKinds) {
    const char* name = kind == places::Kind::kPoint ? "points" : "lines";
    fmt::print("{0}.words: {1}\n{0}.features: {2}\n{0}.depth: {3}\n", name, vocabulary.word_count(kind),
               vocabulary.feature_count(kind), vocabulary.depth(kind));
  }
}

core::Result<void> train(const TrainRequest& request, Session& session) {
  Descriptors descriptors;
  for (const std::string& input : request.inputs) {
    if (auto collected = collect(input, request, session, descriptors); !collected) return collected;
  }
  if (descriptors.points.empty() && descriptors.lines.empty()) {
    return core::input_error("no frame has any feature; there is nothing to learn words from");
  }
  const places::Vocabulary vocabulary =
      places::Vocabulary::train(descriptors.points, descriptors.lines, request.options);
  if (auto written = vocabulary.write(request.output); !written) return written;
  if (!session.quiet) print(vocabulary);
  return {};
}

core::Result<void> info(const std::filesystem::path& file) {
  const auto vocabulary = places::Vocabulary::read(file);
  if (!vocabulary) return tl::unexpected<core::Error>(vocabulary.error());
  print(*vocabulary);
  return {};
}

}  // namespace

void add_vocabulary(CLI::App& app, Session& session) {
  CLI::App* group = add_group(app, "vocabulary", "Words to recognise places by");
  const auto request = std::make_shared<TrainRequest>();
  CLI::App* command =
      add_command(*group, session, "train", "Learn a fixed vocabulary from recordings", [&session, request] {
        const auto done = train(*request, session);
        return done ? 0 : session.fail(done.error());
      });
  command->add_option("INPUT", request->inputs, "Recordings, or synth:SCENE?...")->required();
  command->add_option("-o,--output", request->output, "Vocabulary file to write")->required();
  command->add_option("--every", request->every, "Learn from every n-th frame")
      ->check(CLI::Range(1, 1000000));
  command->add_option("--branching", request->options.branching, "Children of a node at most")
      ->check(CLI::Range(2, 64));
  command->add_option("--levels", request->options.levels, "Levels of the tree at most")
      ->check(CLI::Range(1, 12));
  command->add_option("--camera", request->open.camera, "Shipped calibration or camera file");
  const auto file = std::make_shared<std::filesystem::path>();
  CLI::App* about = add_command(*group, session, "info", "What is in a vocabulary file", [&session, file] {
    const auto done = info(*file);
    return done ? 0 : session.fail(done.error());
  });
  about->add_option("FILE", *file, "Vocabulary file")->required();
}

}  // namespace plumbline::cli
