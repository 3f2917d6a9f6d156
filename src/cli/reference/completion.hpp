// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Candidates for the place of the last word of a command line.
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "reference/command_reference.hpp"

namespace plumbline::cli {

struct Candidate {
  std::string word;
  std::string help;  ///< one line; may be empty
};

struct Completion {
  enum class Paths { kNone, kFolders, kFiles };
  std::vector<Candidate> candidates;  ///< those that begin with the last word
  Paths paths = Paths::kNone;         ///< may stand there, too
  bool open = false;                  ///< the word goes on: no blank is wanted behind it
};

/// Names that are not known from the declarations alone. Each is asked when it is wanted only.
class NameSource {
 public:
  virtual ~NameSource() = default;
  enum class Kind { kPipelines, kCameras, kScenes, kChains, kStages, kFilters, kFormats };
  [[nodiscard]] virtual std::vector<Candidate> names(Kind kind) const = 0;
  /// "track.loops" and so on of a pipeline.
  [[nodiscard]] virtual std::vector<Candidate> keys(const std::string& pipeline) const = 0;
  /// The values of a key; empty: numbers or text.
  [[nodiscard]] virtual std::vector<std::string> values(const std::string& pipeline,
                                                        const std::string& key) const = 0;
  /// Robots in results.
  [[nodiscard]] virtual std::vector<std::string> robots(const std::vector<std::string>& maps) const = 0;
};

/// `words` without the program's own; the last one is being typed and may be empty.
Completion complete(const CommandReference& program, const std::vector<std::string>& words,
                    const NameSource& source);

/// The words of a line as a shell splits them: blanks, quotes, backslashes. The last may be empty.
std::vector<std::string> shell_words(const std::string& line);

/// The script that a shell reads: "bash", "zsh" or "fish". Errors (kUsage): another one.
core::Result<std::string> completion_script(const std::string& shell);

}  // namespace plumbline::cli
