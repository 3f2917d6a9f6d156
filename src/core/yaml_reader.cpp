// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/mark.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <map>
#include <sstream>
#include <system_error>

#include "plumbline/core/config.hpp"
#include "plumbline/core/git_lfs.hpp"
#include "plumbline/core/shortage.hpp"

namespace plumbline::core {
namespace {

constexpr std::size_t kMaxBytes = 1'000'000;
constexpr std::size_t kMaxDepth = 20;
constexpr std::size_t kMaxNodes = 100'000;
// yaml-cpp reads to the end of a line, and of the brackets opened in it, before it reports anything, with
// some 200 bytes per token; no file written by a person comes near these limits.
constexpr int kMaxColumns = 100'000;
constexpr int kMaxOpenBrackets = 1000;

/// Ends the walk, because the rest cannot be read.
struct Refused {
  ConfigProblem problem;
};

std::size_t count_nodes(const ConfigNode& node) {
  std::size_t count = 1;
  for (const ConfigNode& item : node.items) count += count_nodes(item);
  for (const auto& [key, value] : node.entries) count += count_nodes(value);
  return count;
}

std::size_t depth_of(const ConfigNode& node) {
  std::size_t deepest = 0;
  for (const ConfigNode& item : node.items) deepest = std::max(deepest, depth_of(item));
  for (const auto& [key, value] : node.entries) deepest = std::max(deepest, depth_of(value));
  return deepest + 1;
}

/// Builds the tree from yaml-cpp's parse events rather than from YAML::Node, which drops duplicate keys and
/// the places of keys, and expands aliases without counting.
class TreeBuilder : public YAML::EventHandler {
 public:
  TreeBuilder(std::string file, ConfigProblems& problems) : file_(std::move(file)), problems_(problems) {}

  ConfigNode take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& at) override {
    if (documents_++ > 0) refuse(mark(at), "text after the end of the document (one document per file)");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& at, YAML::anchor_t anchor) override {
    ConfigNode node;
    node.mark = mark(at);
    leaf(std::move(node), anchor);
  }
  void OnScalar(const YAML::Mark& at, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    // yaml-cpp tags quoted texts with an exclamation mark
    check_tag(at, tag);
    ConfigNode node;
    node.kind = ConfigNode::Kind::kScalar;
    node.mark = mark(at);
    node.scalar = value;
    node.quoted = tag == "!";
    leaf(std::move(node), anchor);
  }
  void OnAlias(const YAML::Mark& at, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) refuse(mark(at), "the alias contains itself");
    // Counted before it is copied: nested aliases grow exponentially.
    count(found->second.nodes, mark(at));
    if (open_.size() + found->second.depth > kMaxDepth) too_deep(mark(at));
    ConfigNode copy = found->second.node;
    copy.mark = mark(at);
    attach(std::move(copy));
  }
  void OnSequenceStart(const YAML::Mark& at, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    start(ConfigNode::Kind::kSequence, at, tag, anchor);
  }
  void OnMapStart(const YAML::Mark& at, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    start(ConfigNode::Kind::kMap, at, tag, anchor);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapEnd() override { end(); }

 private:
  struct Open {
    ConfigNode node;
    YAML::anchor_t anchor = 0;
    bool has_key = false;  ///< in a map: the next node is the value of `key`
    bool duplicate = false;
    std::string key;
    ConfigMark key_mark;
    std::map<std::string, int> lines;  ///< line of each key so far
  };
  struct Anchored {
    ConfigNode node;
    std::size_t nodes = 0;
    std::size_t depth = 0;
  };

  [[nodiscard]] ConfigMark mark(const YAML::Mark& at) const {
    if (at.is_null()) return {file_, 0, 0};
    return {file_, at.line + 1, at.column + 1};
  }
  [[noreturn]] void refuse(ConfigMark at, std::string what) const {
    throw Refused{{std::move(at), path(), std::move(what)}};
  }
  [[noreturn]] void too_deep(ConfigMark at) const {
    refuse(std::move(at), fmt::format("nested too deeply (allowed: {} levels)", kMaxDepth));
  }
  void count(std::size_t nodes, const ConfigMark& at) {
    nodes_ += nodes;
    if (nodes_ > kMaxNodes) {
      refuse(at, fmt::format("too many values after alias expansion (allowed: {})", kMaxNodes));
    }
  }
  void check_tag(const YAML::Mark& at, const std::string& tag) {
    if (tag.empty() || tag == "?" || tag == "!") return;
    problems_.push_back({mark(at), path(), fmt::format("the tag '{}' means nothing here; remove it", tag)});
  }
  /// Dotted path of the node that is being read.
  [[nodiscard]] std::string path() const {
    std::string text;
    for (const Open& open : open_) {
      if (open.node.kind == ConfigNode::Kind::kMap && open.has_key) {
        text += (text.empty() ? "" : ".") + open.key;
      } else if (open.node.kind == ConfigNode::Kind::kSequence) {
        text += fmt::format("[{}]", open.node.items.size());
      }
    }
    return text;
  }

  void leaf(ConfigNode node, YAML::anchor_t anchor) {
    count(1, node.mark);
    if (anchor != 0) anchors_[anchor] = {node, 1, 1};
    attach(std::move(node));
  }
  void start(ConfigNode::Kind kind, const YAML::Mark& at, const std::string& tag, YAML::anchor_t anchor) {
    count(1, mark(at));
    check_tag(at, tag);

    // A limit on depth protects the recursion
    if (open_.size() >= kMaxDepth) too_deep(mark(at));
    if (!open_.empty() && open_.back().node.kind == ConfigNode::Kind::kMap && !open_.back().has_key) {
      refuse(mark(at), "a key must be a plain word");
    }

    // The node joins its parent when it ends
    Open open;
    open.node.kind = kind;
    open.node.mark = mark(at);
    open.anchor = anchor;
    open_.push_back(std::move(open));
  }
  void end() {
    Open done = std::move(open_.back());
    open_.pop_back();

    // Aliases may copy this node later
    if (done.anchor != 0) {
      const std::size_t nodes = count_nodes(done.node);
      count(nodes, done.node.mark);  // the anchor keeps a copy: anchors within anchors add up
      anchors_[done.anchor] = {done.node, nodes, depth_of(done.node)};
    }
    attach(std::move(done.node));
  }
  void attach(ConfigNode node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    Open& parent = open_.back();

    // A map takes a key and a value in turn
    if (parent.node.kind == ConfigNode::Kind::kSequence) {
      parent.node.items.push_back(std::move(node));
    } else if (!parent.has_key) {
      take_key(parent, node);
    } else {
      if (!parent.duplicate) {
        parent.node.entries.emplace_back(parent.key, std::move(node));
        parent.node.key_marks.push_back(parent.key_mark);
      }
      parent.has_key = false;
    }
  }
  void take_key(Open& parent, const ConfigNode& key) {
    if (key.kind != ConfigNode::Kind::kScalar) refuse(key.mark, "a key must be a plain word");
    parent.key = key.scalar;
    parent.key_mark = key.mark;
    parent.has_key = true;
    parent.duplicate = false;

    // The first of two equal keys counts
    const auto [first, fresh] = parent.lines.emplace(key.scalar, key.mark.line);
    if (fresh) return;
    parent.duplicate = true;
    problems_.push_back(
        {key.mark, path(), fmt::format("the key is given twice (first in line {})", first->second)});
  }

  std::string file_;
  ConfigProblems& problems_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Anchored> anchors_;
  std::size_t nodes_ = 0;
  int documents_ = 0;
  ConfigNode root_;
};

/// Refuses texts that would cost excessive time or memory, and control characters: yaml-cpp treats 0x04 as
/// the end of the file, so that it would hide the rest.
void check_characters(const std::string& text, const std::string& file) {
  int line = 1;
  int column = 1;
  int open = 0;  // brackets, those in comments and quotes as well

  // Limits are checked before yaml-cpp allocates
  for (const char c : text) {
    open += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    if (column > kMaxColumns || open > kMaxOpenBrackets) {
      throw Refused{{{file, line, column},
                     "",
                     column > kMaxColumns ? fmt::format("the line is over {} characters long", kMaxColumns)
                                          : fmt::format("over {} brackets are open here", kMaxOpenBrackets)}};
    }

    // Columns count from the line's beginning
    const auto byte = static_cast<unsigned char>(c);
    if (c == '\n') {
      ++line;
      column = 1;
      continue;
    }

    // Binary files end here
    if (byte < 0x20 && c != '\t' && c != '\r') {
      throw Refused{{{file, line, column},
                     "",
                     fmt::format("control character 0x{:02x}; this is not a text file", byte)}};
    }

    ++column;
  }
}

/// Nothing sensible can be read: the problem is reported, and no tree given.
std::optional<ConfigNode> unreadable(const std::filesystem::path& file, const std::string& what,
                                     ConfigProblems& problems) {
  problems.push_back({{file.string(), 0, 0}, "", what});
  return std::nullopt;
}

Result<ConfigNode> whole(std::optional<ConfigNode> node, const ConfigProblems& problems) {
  if (!problems.empty()) return tl::unexpected(to_error(problems));
  return std::move(*node);
}

}  // namespace

std::optional<ConfigNode> parse_yaml(const std::string& text, const std::string& file_name,
                                     ConfigProblems& problems) {
  try {
    if (text.size() > kMaxBytes) {
      throw Refused{{{file_name, 0, 0}, "", "the file is over 1 MB; this is not a configuration file"}};
    }

    // Building the tree checks depth and number of nodes
    check_characters(text, file_name);
    std::istringstream stream(text);
    YAML::Parser parser(stream);

    TreeBuilder builder(file_name, problems);
    while (parser.HandleNextDocument(builder)) {
    }

    // Nothing but comments gives an empty tree
    ConfigNode root = builder.take_root();
    if (root.mark.file.empty()) root.mark.file = file_name;  // an empty document has no place of its own
    return root;
  } catch (const Refused& refused) {
    problems.push_back(refused.problem);
  } catch (const YAML::Exception& e) {
    ConfigMark mark{file_name, 0, 0};
    if (!e.mark.is_null()) mark = {file_name, e.mark.line + 1, e.mark.column + 1};
    problems.push_back({mark, "", "not valid YAML: " + e.msg});
  }

  return std::nullopt;
}

std::optional<ConfigNode> read_yaml(const std::filesystem::path& file, ConfigProblems& problems) {
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return unreadable(file, "no such file", problems);
  if (std::filesystem::is_directory(file, ignored)) {
    return unreadable(file, "is a folder, not a YAML file", problems);
  }

  std::ifstream stream(file, std::ios::binary);
  if (!stream) {
    // Not a fault of the configuration, so it ends the command as missing memory does.
    if (!shortage_of(errno).empty()) throw std::system_error(errno, std::generic_category(), file.string());
    return unreadable(file, "cannot be read; check its permissions", problems);
  }

  // Reading one byte more than allowed shows that it is too large; the file may be a device without end.
  std::string text(kMaxBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (stream.bad()) return unreadable(file, "cannot be read", problems);
  text.resize(static_cast<std::size_t>(stream.gcount()));
  if (begins_as_lfs_pointer(text)) return unreadable(file, kLfsPointer, problems);
  return parse_yaml(text, file.string(), problems);
}

Result<ConfigNode> parse_yaml(const std::string& text, const std::string& file_name) {
  ConfigProblems problems;
  auto node = parse_yaml(text, file_name, problems);
  return whole(std::move(node), problems);
}

Result<ConfigNode> read_yaml(const std::filesystem::path& file) {
  ConfigProblems problems;
  auto node = read_yaml(file, problems);
  return whole(std::move(node), problems);
}

/// Names of the YAML files of a folder without their ending, sorted.
std::vector<std::string> yaml_names(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Result<std::filesystem::path> find_yaml(const char* what, const std::string& name_or_file,
                                        const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& file :
       {std::filesystem::path(name_or_file), folder / name_or_file, folder / (name_or_file + ".yaml")}) {
    if (std::filesystem::is_regular_file(file, ignored)) return file;
  }
  return usage_error(fmt::format("{} '{}': neither a file nor one of {}{}", what, name_or_file,
                                 folder.string(), hint(name_or_file, yaml_names(folder))));
}

}  // namespace plumbline::core
