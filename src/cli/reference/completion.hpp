// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Candidates for the last word of a command line.
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
  Paths paths = Paths::kNone;         ///< paths that are allowed as well
  bool open = false;                  ///< the word is not complete: no blank after it
};

/// Names that the declarations do not contain. Each list is read only if it is needed.
class NameSource {
 public:
  virtual ~NameSource() = default;
  enum class Kind { kPipelines, kCameras, kScenes, kChains, kStages, kFilters, kFormats };
  [[nodiscard]] virtual std::vector<Candidate> names(Kind kind) const = 0;
  /// Keys of a pipeline, such as "track.loops".
  [[nodiscard]] virtual std::vector<Candidate> keys(const std::string& pipeline) const = 0;
  /// The values that a key may have; empty: numbers or text.
  [[nodiscard]] virtual std::vector<std::string> values(const std::string& pipeline,
                                                        const std::string& key) const = 0;
  /// Robots in results.
  [[nodiscard]] virtual std::vector<std::string> robots(const std::vector<std::string>& maps) const = 0;
};

/// Completes the last of `words`, which may be empty; the program's name is not among them.
Completion complete(const CommandReference& program, const std::vector<std::string>& words,
                    const NameSource& source);

/// The words of a line as a shell splits them: blanks, quotes, backslashes. The last may be empty.
std::vector<std::string> shell_words(const std::string& line);

/// The completion script of a shell: "bash", "zsh" or "fish". Errors (kUsage): another one.
core::Result<std::string> completion_script(const std::string& shell);

}  // namespace plumbline::cli
