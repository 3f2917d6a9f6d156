// SPDX-License-Identifier: BSD-3-Clause
// plumbline completion SHELL, plumbline complete WORD..., plumbline man [COMMAND...]
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <memory>

#include "app.hpp"
#include "empty_values.hpp"
#include "plumbline/core/config.hpp"
#include "plumbline/core/options.hpp"
#include "plumbline/core/output_file.hpp"
#include "plumbline/exports/export.hpp"
#include "plumbline/maps/stored_run.hpp"
#include "plumbline/pipeline/graph.hpp"
#include "plumbline/pipeline/reference.hpp"
#include "reference/completion.hpp"
#include "reference/man_page.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

/// Names from the shipped files, the registries and results. Sources that cannot be read give none.
class ShippedNames : public NameSource {
 public:
  explicit ShippedNames(const Session& session) : session_(session) {
    pipeline::register_stages(registry_);
    const auto folder = session.pipelines_folder();
    if (folder) folder_ = *folder;
  }

  /// Names of shipped files and of registered types.
  [[nodiscard]] std::vector<Candidate> names(Kind kind) const override {
    switch (kind) {
      case Kind::kPipelines:
        return files("");
      case Kind::kCameras:
        return files("cameras");
      case Kind::kScenes:
        return files("scenes");
      case Kind::kChains:
        return files("filters");
      case Kind::kStages:
        return stages();
      case Kind::kFilters:
        return filters();
      case Kind::kFormats:
        return formats();
    }
    return {};
  }

  /// Keys for --set, with their defaults.
  [[nodiscard]] std::vector<Candidate> keys(const std::string& pipeline) const override {
    std::vector<Candidate> keys;
    for (const pipeline::Node& node : load(pipeline).nodes) {
      if (node.tap) continue;
      for (const core::OptionSpec& spec : pipeline::shown_options(*node.type))
        keys.push_back(
            {node.name + "." + spec.key, fmt::format("{} (default: {})", spec.help, spec.default_value)});
    }
    return keys;
  }

  /// Values that an option may have, as far as they are known.
  [[nodiscard]] std::vector<std::string> values(const std::string& pipeline,
                                                const std::string& key) const override {
    for (const pipeline::Node& node : load(pipeline).nodes) {
      for (const core::OptionSpec& spec : node.options.specs()) {
        if (node.name + "." + spec.key != key) continue;
        if (spec.type == core::OptionType::kBoolean) return {"on", "off"};
        return spec.type == core::OptionType::kChoice ? spec.choices
                                                      : std::vector<std::string>{spec.default_value};
      }
    }
    return {};
  }

  /// Robots of the maps that the line names.
  [[nodiscard]] std::vector<std::string> robots(const std::vector<std::string>& maps) const override {
    std::vector<std::string> names;
    for (const std::string& map : maps) {
      const auto place = maps::find_map(map);
      if (!place || place->store.empty()) continue;
      const auto reader = maps::StoreReader::open(place->store);
      if (!reader) continue;
      for (const maps::RobotInfo& robot : reader->header().robots) names.push_back(robot.name);
    }
    return names;
  }

 private:
  [[nodiscard]] std::vector<Candidate> files(const char* folder) const {
    std::vector<Candidate> found;
    for (const std::string& name : core::yaml_names(folder_ / folder)) found.push_back({name, ""});
    return found;
  }

  [[nodiscard]] std::vector<Candidate> stages() const {
    std::vector<Candidate> found;
    for (const pipeline::StageTypePtr& type : registry_.types()) found.push_back({type->name, type->help});
    return found;
  }

  [[nodiscard]] std::vector<Candidate> filters() const {
    std::vector<Candidate> found;
    for (const cloud::FilterInfo& info : registry_.filters().filters())
      found.push_back({info.type, info.summary});
    return found;
  }

  [[nodiscard]] static std::vector<Candidate> formats() {
    std::vector<Candidate> found;
    for (const exports::FormatInfo& format : exports::export_formats())
      found.push_back({format.name, format.title});
    return found;
  }

  [[nodiscard]] pipeline::Graph load(const std::string& name) const {
    const auto file = core::find_yaml("pipeline", name, folder_);
    if (!file) return {};
    auto graph = pipeline::load_graph(*file, registry_, folder_, {});
    return graph ? std::move(*graph) : pipeline::Graph();
  }

  const Session& session_;
  pipeline::StageRegistry registry_;
  fs::path folder_;
};

struct CompleteRequest {
  std::string line;                ///< all of it, as typed; empty: `words` are given
  std::string word;                ///< last word according to the shell, which splits at '=' and ':'
  std::vector<std::string> words;  ///< behind the program's name
};

/// Drops the program's name and everything before it (`time`, assignments), unless the shell has removed them
/// already.
std::vector<std::string> words_of(const CompleteRequest& request) {
  if (request.line.empty()) return request.words;
  const std::vector<std::string> words = shell_words(request.line);
  const auto program = std::find_if(words.begin(), std::prev(words.end()), [](const std::string& word) {
    return fs::path(word).filename() == "plumbline";
  });
  return {std::next(program), words.end()};
}

int complete_line(const CompleteRequest& request, const CLI::App& app, const Session& session) {
  const std::vector<std::string> words = words_of(request);
  const Completion completion = complete(command_reference(app), words, ShippedNames(session));
  const char* const paths = completion.paths == Completion::Paths::kFiles     ? "files"
                            : completion.paths == Completion::Paths::kFolders ? "folders"
                                                                              : "none";
  print("{}{}\n", paths, completion.open ? " open" : "");

  // In "track.loops=o" bash completes only what follows the last word break.
  const std::string last = words.empty() ? "" : words.back();
  const bool split = !request.line.empty() && last.size() > request.word.size();
  const std::size_t before = split ? last.size() - request.word.size() : 0;
  for (const Candidate& candidate : completion.candidates) {
    const std::string help = candidate.help.substr(0, candidate.help.find('\n'));
    print("{}\t{}\n", candidate.word.substr(std::min(before, candidate.word.size())), help);
  }
  return 0;
}

struct ManRequest {
  std::vector<std::string> words;
  fs::path folder;
};

/// One page per command, and one for the program.
core::Result<void> write_pages(const CommandReference& command, const CommandReference& program,
                               const fs::path& folder) {
  const fs::path file = folder / (command.name("-") + ".1");
  if (auto written = core::write_file(file, man_page(command, program)); !written) return written;
  for (const CommandReference& below : command.commands) {
    if (auto written = write_pages(below, program, folder); !written) return written;
  }
  return {};
}

/// A page on standard output, or all pages in a folder.
core::Result<void> man(const ManRequest& request, const CLI::App& app) {
  const CommandReference program = command_reference(app);
  if (!request.folder.empty()) {
    if (auto made = core::make_folder(request.folder); !made) return made;
    return write_pages(program, program, request.folder);
  }

  const CommandReference* command = &program;
  for (const std::string& word : request.words) {
    command = command->find(word);
    if (command != nullptr) continue;
    return core::usage_error(fmt::format("there is no command '{}'; plumbline --help lists them", word));
  }
  print("{}", man_page(*command, program));
  return {};
}

/// Options of man.
void add_man(CLI::App& app, Session& session) {
  const auto request = std::make_shared<ManRequest>();
  CLI::App* command = add_command(app, session, "man", "Print the manual page of a command, for man -l -",
                                  [request, &app] { return man(*request, app); });
  command->add_option("COMMAND", request->words, "Words of the command (default: the program itself)");
  command
      ->add_option("-o,--output", request->folder, "Write the pages of all commands into this folder instead")
      ->type_name("DIR");
}

/// The hidden command that the scripts call.
void add_complete(CLI::App& app, Session& session) {
  const auto request = std::make_shared<CompleteRequest>();
  CLI::App* command = app.add_subcommand("complete", "Used by the scripts of `plumbline completion`");
  command->group("");  // called by shells, not shown in --help
  may_be_empty(command->add_option("--line", request->line));
  may_be_empty(command->add_option("--word", request->word));
  may_be_empty(command->add_option("WORDS", request->words));
  command->callback([request, &app, &session] {
    session.command = [request, &app, &session] { return complete_line(*request, app, session); };
  });
}

}  // namespace

void add_completion(CLI::App& app, Session& session) {
  // The script is printed, not installed
  const auto shell = std::make_shared<std::string>();
  CLI::App* command = add_command(app, session, "completion",
                                  "Print a script with which a shell completes plumbline's commands",
                                  [shell]() -> core::Result<void> {
                                    const auto script = completion_script(*shell);
                                    if (!script) return tl::unexpected<core::Error>(script.error());
                                    print("{}", *script);
                                    return {};
                                  });

  // Shell and instructions
  command->add_option("SHELL", *shell, "The shell")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  command->footer(
      "Packages bring these scripts along. By hand:\n"
      "  bash: plumbline completion bash > ~/.local/share/bash-completion/completions/plumbline\n"
      "  zsh:  plumbline completion zsh > DIR/_plumbline   (DIR in $fpath, before compinit)\n"
      "  fish: plumbline completion fish > ~/.config/fish/completions/plumbline.fish");

  // Commands that read the same reference
  add_man(app, session);
  add_complete(app, session);
}

}  // namespace plumbline::cli
