// SPDX-License-Identifier: BSD-3-Clause
#include "reference/completion.hpp"

#include <algorithm>
#include <map>
#include <optional>

namespace plumbline::cli {
namespace {

using Paths = Completion::Paths;
using Kind = NameSource::Kind;

bool begins_with(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

/// Sources of an argument's values.
struct ValueKind {
  std::optional<Kind> names;
  Paths paths = Paths::kNone;
};

/// Source by the value's name; values that are not listed are numbers or free text.
ValueKind value_kind(const std::string& value) {
  static const std::map<std::string, ValueKind> kinds = {
      {"PIPELINE", {Kind::kPipelines, Paths::kFiles}}, {"NAME|FILE", {Kind::kCameras, Paths::kFiles}},
      {"SCENE", {Kind::kScenes, Paths::kFiles}},       {"CHAIN", {Kind::kChains, Paths::kFiles}},
      {"STAGE", {Kind::kStages, Paths::kNone}},        {"INPUT", {std::nullopt, Paths::kFiles}},
      {"OUT", {std::nullopt, Paths::kFolders}},        {"DIR", {std::nullopt, Paths::kFolders}},
      {"MAP", {std::nullopt, Paths::kFiles}},          {"FILES", {std::nullopt, Paths::kFiles}},
      {"EST", {std::nullopt, Paths::kFiles}},          {"GT", {std::nullopt, Paths::kFiles}},
      {"CLOUD", {std::nullopt, Paths::kFiles}},        {"REFERENCE", {std::nullopt, Paths::kFiles}}};
  const auto found = kinds.find(value);
  if (found != kinds.end()) return found->second;

  const bool is_path = value.find("FILE") != std::string::npos || value.find("FOLDER") != std::string::npos ||
                       value.find("LIST") != std::string::npos;
  return {std::nullopt, is_path ? Paths::kFiles : Paths::kNone};
}

/// The part of a command line that has been typed.
class Line {
 public:
  Line(const CommandReference& program, const std::vector<std::string>& words, const NameSource& source)
      : command_(&program), source_(source), typed_(words.empty() ? "" : words.back()) {
    for (std::size_t i = 0; i + 1 < words.size(); ++i) read(words[i]);
  }

  /// Candidates for the word under the cursor.
  Completion complete() {
    if (waiting_ != nullptr) return values_of(*waiting_, "", typed_);
    const std::size_t equals = typed_.find('=');
    if (!only_positionals_ && begins_with(typed_, "--") && equals != std::string::npos) {
      const ArgumentReference* argument = flag(typed_.substr(0, equals));
      if (argument == nullptr || !argument->takes_value()) return {};
      return values_of(*argument, typed_.substr(0, equals + 1), typed_.substr(equals + 1));
    }
    if (!only_positionals_ && begins_with(typed_, "-")) return flags();

    if (!command_->commands.empty()) return commands();
    const ArgumentReference* next = positional();
    return next == nullptr ? flags() : values_of(*next, "", typed_);
  }

 private:
  void read(const std::string& word) {
    if (waiting_ != nullptr) {
      given_[waiting_->name].push_back(word);
      waiting_ = nullptr;
    } else if (!only_positionals_ && word == "--") {
      only_positionals_ = true;
    } else if (!only_positionals_ && word.size() > 1 && word.front() == '-') {
      read_flag(word);
    } else if (const CommandReference* below = command_->find(word); below != nullptr) {
      command_ = below;
    } else {
      positionals_.push_back(word);
    }
  }

  /// The value follows the equals sign, or is the next word.
  void read_flag(const std::string& word) {
    const std::size_t equals = word.find('=');
    const ArgumentReference* argument = flag(word.substr(0, equals));
    if (argument == nullptr || !argument->takes_value()) return;
    if (equals == std::string::npos) {
      waiting_ = argument;
    } else {
      given_[argument->name].push_back(word.substr(equals + 1));
    }
  }

  [[nodiscard]] const ArgumentReference* flag(const std::string& name) const {
    for (const ArgumentReference& argument : command_->arguments) {
      if (std::count(argument.flags.begin(), argument.flags.end(), name) > 0) return &argument;
    }
    return nullptr;
  }

  /// The positional argument that comes next.
  [[nodiscard]] const ArgumentReference* positional() const {
    std::size_t place = 0;
    for (const ArgumentReference& argument : command_->arguments) {
      if (!argument.positional()) continue;
      if (argument.repeated || place == positionals_.size()) return &argument;
      ++place;
    }
    return nullptr;
  }

  void add(Completion& completion, const std::string& start, const std::string& word,
           const std::string& help) const {
    if (begins_with(start + word, typed_)) completion.candidates.push_back({start + word, help});
  }

  [[nodiscard]] Completion commands() const {
    Completion completion;
    for (const CommandReference& below : command_->commands)
      add(completion, "", below.words.back(), below.help);
    return completion;
  }

  /// Flags that may still be given.
  [[nodiscard]] Completion flags() const {
    Completion completion;
    for (const ArgumentReference& argument : command_->arguments) {
      const bool again = argument.repeated || given_.count(argument.name) == 0;
      if (!argument.positional() && again) add(completion, "", argument.flags.back(), argument.help);
    }
    return completion;
  }

  [[nodiscard]] Completion values_of(const ArgumentReference& argument, const std::string& start,
                                     const std::string& value) const {
    // Settings and robots depend on earlier words
    Completion completion;
    const std::string& name = argument.positional() ? argument.name : argument.value;
    if (name == "stage.key=value") return settings(start, value);
    if (argument.name == "--robot" || argument.name == "--anchor") {
      for (const std::string& robot : source_.robots(positionals_)) add(completion, start, robot, "");
      return completion;
    }

    // Choices are known completely
    for (const std::string& choice : argument.choices) add(completion, start, choice, "");
    if (!argument.choices.empty()) return completion;

    // Names of shipped files and types
    const ValueKind kind = kind_of(argument, name);
    if (kind.names) {
      for (const Candidate& known : source_.names(*kind.names))
        add(completion, start, known.word, known.help);
    }

    // Generated scenes are an input too
    if (name == "INPUT" && begins_with(value, "s")) {
      for (const Candidate& scene : source_.names(Kind::kScenes))
        add(completion, start + "synth:", scene.word, "a generated world, filmed while mapping");
    }
    completion.paths = kind.paths;
    return completion;
  }

  /// The same value name means different things in two commands.
  [[nodiscard]] ValueKind kind_of(const ArgumentReference& argument, const std::string& name) const {
    const std::string command = command_->name(" ");
    if (argument.positional() && command == "plumbline filters describe")
      return {Kind::kFilters, Paths::kNone};
    if (argument.name == "--format" && command == "plumbline export") return {Kind::kFormats, Paths::kNone};
    if (argument.positional() && command == "plumbline filter" && name == "FILES")
      return {std::nullopt, Paths::kFiles};
    return value_kind(name);
  }

  /// "stage.key=" and, behind it, what is allowed.
  [[nodiscard]] Completion settings(const std::string& start, const std::string& value) const {
    Completion completion;
    const std::string pipeline = chosen_pipeline();
    const std::size_t equals = value.find('=');
    if (equals == std::string::npos) {
      for (const Candidate& key : source_.keys(pipeline)) add(completion, start, key.word + "=", key.help);
      completion.open = true;
      return completion;
    }

    const std::string key = value.substr(0, equals);
    for (const std::string& allowed : source_.values(pipeline, key))
      add(completion, start + key + "=", allowed, "");
    return completion;
  }

  [[nodiscard]] std::string chosen_pipeline() const {
    const auto chosen = given_.find("--pipeline");
    if (chosen != given_.end()) return chosen->second.back();
    if (begins_with(command_->name(" "), "plumbline pipelines") && !positionals_.empty())
      return positionals_.front();
    return command_->words.front() == "fuse" || command_->words.front() == "hub" ? "fuse" : "rgbd";
  }

  const CommandReference* command_;
  const NameSource& source_;
  std::string typed_;
  std::map<std::string, std::vector<std::string>> given_;  ///< by the argument's name
  std::vector<std::string> positionals_;
  const ArgumentReference* waiting_ = nullptr;  ///< its value comes next
  bool only_positionals_ = false;
};

}  // namespace

Completion complete(const CommandReference& program, const std::vector<std::string>& words,
                    const NameSource& source) {
  return Line(program, words, source).complete();
}

std::vector<std::string> shell_words(const std::string& line) {
  // Quotes join words
  std::vector<std::string> words{""};
  char quote = 0;
  bool begun = false;

  // Blanks outside quotes end a word
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote == 0 && (c == ' ' || c == '\t')) {
      if (begun) words.emplace_back();
      begun = false;
      continue;
    }

    // Empty quotes are a word, too
    begun = true;

    if (c == '\\' && quote != '\'' && i + 1 < line.size()) {
      words.back() += line[++i];
    } else if (quote == 0 && (c == '\'' || c == '"')) {
      quote = c;
    } else if (c == quote) {
      quote = 0;
    } else {
      words.back() += c;
    }
  }

  return words;
}

}  // namespace plumbline::cli
