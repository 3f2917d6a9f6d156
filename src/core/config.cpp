// SPDX-License-Identifier: BSD-3-Clause
#include "plumbline/core/config.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "plumbline/core/text.hpp"

namespace plumbline::core {
namespace {

/// Edit distance where swapping two neighbours costs one (optimal string alignment).
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

std::string folded(const std::string& word) {
  std::string out;
  for (const char c : word) {
    out += c == '-' ? '_' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

/// True if a text reads back as itself without quotes.
bool reads_back_plain(const std::string& text) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view(" _/.+-%").find(static_cast<char>(c)) != std::string::npos;
  };
  if (text.empty() || text.back() == ' ' || !std::all_of(text.begin(), text.end(), is_plain)) return false;
  if (folded(text) == "null") return false;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  const char first = text.front();
  return std::isalnum(static_cast<unsigned char>(first)) != 0 || first == '/' || first == '.' ||
         ((first == '-' || first == '+') && text.size() > 1 && digit(text[1]));
}

/// A text as YAML, quoted where YAML would otherwise read something else.
std::string text_as_yaml(const std::string& text, bool quoted) {
  if (!quoted && reads_back_plain(text)) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n') {
      out += "\\n";
    } else {
      out += c;
    }
  }
  return out + "\"";
}

/// The candidate with the fewest typing errors, "" when even that has too many.
template <typename Name>
std::string nearest(const std::string& word, const std::vector<std::string>& candidates, const Name& name) {
  constexpr std::size_t kLongestWord = 64;
  if (word.empty() || word.size() > kLongestWord) return "";
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    const std::string known = name(candidate);
    if (known.size() > kLongestWord) continue;
    const std::size_t distance = edit_distance(folded(word), folded(known));
    if (distance < best_distance && distance < known.size()) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

}  // namespace

const ConfigNode* ConfigNode::find(const std::string& key) const {
  for (const auto& [name, value] : entries) {
    if (name == key) return &value;
  }
  return nullptr;
}

std::string to_string(const ConfigProblems& problems) {
  std::vector<std::string> files;  // in order of first mention
  for (const ConfigProblem& p : problems) {
    if (std::find(files.begin(), files.end(), p.mark.file) == files.end()) files.push_back(p.mark.file);
  }

  std::string text;
  for (const std::string& file : files) {
    std::vector<const ConfigProblem*> here;
    for (const ConfigProblem& p : problems) {
      if (p.mark.file == file) here.push_back(&p);
    }

    std::stable_sort(here.begin(), here.end(), [](const ConfigProblem* a, const ConfigProblem* b) {
      return std::pair(a->mark.line, a->mark.column) < std::pair(b->mark.line, b->mark.column);
    });

    for (const ConfigProblem* p : here) {
      std::string line = file;
      if (p->mark.line > 0) line += fmt::format(":{}:{}", p->mark.line, p->mark.column);

      // "--set features.points: ..." is how the user wrote it; a file is followed by a colon.
      const bool command_line = file.rfind("--", 0) == 0;
      if (!file.empty()) line += command_line ? " " : ": ";
      if (!p->path.empty()) line += p->path + ": ";
      text += (text.empty() ? "" : "\n") + printable(line + p->what);
    }
  }

  return text;
}

Error to_error(const ConfigProblems& problems) {
  return {ErrorKind::kUsage, to_string(problems), problems.size() > 1};
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& candidates) {
  std::string near = nearest(word, candidates, [](const std::string& c) { return c; });
  if (!near.empty()) return near;
  // "max_rotation" for "keyframe.max_rotation": the group was forgotten.
  return nearest(word, candidates, [](const std::string& c) { return c.substr(c.rfind('.') + 1); });
}

static std::string joined(const std::vector<std::string>& names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

/// Advice on a misspelt name: the nearest one, and the allowed ones if they are few.
std::string hint(const std::string& word, const std::vector<std::string>& allowed) {
  constexpr std::size_t kReadable = 16;  // names; a list of a hundred would not be read
  const std::string near = did_you_mean(word, allowed);
  const std::string meant = near.empty() ? "" : fmt::format("; did you mean {}?", near);
  if (allowed.size() <= kReadable)
    return fmt::format("{} (allowed: {})", meant, allowed.empty() ? "nothing" : joined(allowed));
  if (!near.empty()) return meant;

  // A long list is shortened to its groups
  std::vector<std::string> groups;  // "bundle.*" for all of them
  for (const std::string& name : allowed) {
    const std::size_t dot = name.find('.');
    const std::string group = dot == std::string::npos ? name : name.substr(0, dot) + ".*";
    if (std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
  }
  return fmt::format(" (allowed: {})", joined(groups));
}

/// A tree as YAML in one line, with brackets and braces.
std::string to_flow_yaml(const ConfigNode& node) {
  std::vector<std::string> parts;
  switch (node.kind) {
    case ConfigNode::Kind::kNull:
      return "~";
    case ConfigNode::Kind::kScalar:
      return text_as_yaml(node.scalar, node.quoted);
    case ConfigNode::Kind::kSequence:
      for (const ConfigNode& item : node.items) parts.push_back(to_flow_yaml(item));
      return fmt::format("[{}]", fmt::join(parts, ", "));
    case ConfigNode::Kind::kMap:
      for (const auto& [key, value] : node.entries) {
        parts.push_back(fmt::format("{}: {}", text_as_yaml(key, false), to_flow_yaml(value)));
      }
      return fmt::format("{{{}}}", fmt::join(parts, ", "));
  }
  return "~";
}

}  // namespace plumbline::core
