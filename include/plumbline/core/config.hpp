// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A parsed configuration file as a plain tree that remembers where everything stood.
// yaml-cpp stays inside core; everyone else sees these structs.
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"

namespace plumbline::core {

/// Place in a text file; lines and columns count from 1, 0 means unknown (a value from the command line).
struct ConfigMark {
  std::string file;
  int line = 0;
  int column = 0;
};

struct ConfigNode {
  enum class Kind { kNull, kScalar, kSequence, kMap };
  Kind kind = Kind::kNull;
  ConfigMark mark;
  std::string scalar;
  bool quoted = false;            ///< the scalar was written in quotes: never a number or boolean
  std::vector<ConfigNode> items;  ///< items of a sequence
  std::vector<std::pair<std::string, ConfigNode>> entries;  ///< entries of a map, in file order
  std::vector<ConfigMark> key_marks;                        ///< where each entry's key stands

  [[nodiscard]] const ConfigNode* find(const std::string& key) const;
};

/// One problem of a file; all are collected and reported together.
struct ConfigProblem {
  ConfigMark mark;
  std::string path;  ///< dotted path of the key, e.g. "stages.track.points"
  std::string what;  ///< what is wrong, what is allowed, did you mean ...
};
using ConfigProblems = std::vector<ConfigProblem>;

/// "file:line:column: path: what", one line per problem, in file order.
std::string to_string(const ConfigProblems& problems);

/// kUsage error holding all problems.
Error to_error(const ConfigProblems& problems);

/// Reads YAML. Refuses: unreadable files, files over 1 MB, duplicate keys, several documents, non-scalar
/// keys, trees over 20 levels or 100 000 nodes after alias expansion. Messages name file, line and column.
Result<ConfigNode> read_yaml(const std::filesystem::path& file);
Result<ConfigNode> parse_yaml(const std::string& text, const std::string& file_name);

/// The same, with the problems added to a list, so that they can be reported with those of the file's
/// meaning. Empty if nothing useful can be read (no such file, broken syntax, a limit). If a key is given
/// twice the first one counts.
std::optional<ConfigNode> read_yaml(const std::filesystem::path& file, ConfigProblems& problems);
std::optional<ConfigNode> parse_yaml(const std::string& text, const std::string& file_name,
                                     ConfigProblems& problems);

/// Names of the YAML files of a folder, without their ending, sorted.
std::vector<std::string> yaml_names(const std::filesystem::path& folder);
/// Path of a file, or of the one in `folder` with that name. Error (kUsage): neither exists; `what` is its
/// kind for the message, such as "camera".
Result<std::filesystem::path> find_yaml(const char* what, const std::string& name_or_file,
                                        const std::filesystem::path& folder);

/// One line of YAML that reads back as the same tree.
std::string to_flow_yaml(const ConfigNode& node);

/// The word of `candidates` nearest to `word` if it is near enough to be a typing error, else "". Of dotted
/// candidates the last part alone will do.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates);

/// Text that follows "unknown key": "; did you mean voxel? (allowed: voxel, filters)". Of many allowed keys
/// it names only a similar one, else their groups: "(allowed: voxel, filters.*)".
std::string hint(const std::string& word, const std::vector<std::string>& allowed);

}  // namespace plumbline::core
