// SPDX-License-Identifier: BSD-3-Clause
#include "reference/man_page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "plumbline/core/version.hpp"

namespace plumbline::cli {
namespace {

/// Text that troff prints as it is: no escapes, no requests, minus signs that can be copied.
std::string plain(const std::string& text) {
  std::string out;
  for (const char c : text) {
    const bool first = out.empty() || out.back() == '\n';
    if (first && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  return out;
}

std::string bold(const std::string& text) { return "\\fB" + plain(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + plain(text) + "\\fR"; }

/// Lines as they are, tables and examples.
std::string literal(const std::string& text) { return ".PP\n.nf\n" + plain(text) + "\n.fi\n"; }

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

/// "-o, --output OUT" as a heading of its paragraph.
std::string heading(const ArgumentReference& argument) {
  if (argument.positional()) return italic(argument.name) + (argument.repeated ? " ..." : "");
  std::string text;
  for (const std::string& flag : argument.flags) text += (text.empty() ? "" : ", ") + bold(flag);
  return argument.value.empty() ? text : text + " " + italic(argument.value);
}

/// Required flags, then positional arguments.
std::string synopsis(const CommandReference& command) {
  std::string text = ".B " + plain(command.name(" ")) + "\n";
  for (const ArgumentReference& argument : command.arguments) {
    if (argument.positional() || !argument.required) continue;
    text += bold(argument.flags.front()) + " " + italic(argument.value) + "\n";
  }

  text += command.commands.empty() ? "[\\fIOPTIONS\\fR]\n" : "\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n";
  for (const ArgumentReference& argument : command.arguments) {
    if (!argument.positional()) continue;
    const std::string name = italic(argument.name) + (argument.repeated ? " ..." : "");
    text += argument.required ? name + "\n" : "[" + name + "]\n";
  }
  return text;
}

/// One section of arguments, with their choices.
std::string arguments(const CommandReference& command, bool positional, const char* title) {
  std::string text;
  for (const ArgumentReference& argument : command.arguments) {
    if (argument.positional() != positional) continue;
    text += ".TP\n" + heading(argument) + "\n" + plain(argument.help) + "\n";
    const bool shown = argument.value.find('|') != std::string::npos;
    if (argument.choices.empty() || shown) continue;
    std::string choices;
    for (const std::string& choice : argument.choices) choices += (choices.empty() ? "" : ", ") + choice;
    text += "(one of: " + plain(choices) + ")\n";
  }
  return text.empty() ? text : fmt::format(".SH {}\n", title) + text;
}

std::string commands(const CommandReference& command) {
  if (command.commands.empty()) return "";
  std::string text = ".SH COMMANDS\n";
  for (const CommandReference& below : command.commands)
    text += ".TP\n.BR " + plain(below.name("-")) + " (1)\n" + plain(below.help) + "\n";
  return text;
}

/// The page of the program and of the command's group.
std::string see_also(const CommandReference& command, const CommandReference& program) {
  std::string text = ".SH SEE ALSO\n";
  if (command.words.empty())
    return text + "The guide: docs/README.md of the source, or the package plumbline\\-doc.\n";
  text += ".BR " + plain(program.name("-")) + " (1)";
  if (command.words.size() > 1) text += ",\n.BR " + plain("plumbline-" + command.words.front()) + " (1)";
  return text + "\n";
}

}  // namespace

/// Sections in the order of man-pages(7).
std::string man_page(const CommandReference& command, const CommandReference& program) {
  const std::string name = command.name("-");
  std::string page =
      fmt::format(".TH {} 1 \"\" \"plumbline {}\" \"Plumbline\"\n", upper(plain(name)), core::version());
  page += ".nh\n.SH NAME\n" + plain(name) + " \\- " + plain(command.help) + "\n";
  page += ".SH SYNOPSIS\n" + synopsis(command);

  page += commands(command);
  page += arguments(command, true, "ARGUMENTS");
  page += arguments(command, false, "OPTIONS");
  if (!command.footer.empty() && command.footer != program.footer)
    page += ".SH NOTES\n" + literal(command.footer);

  page += ".SH EXIT STATUS\n" + literal(program.footer);
  return page + see_also(command, program);
}

}  // namespace plumbline::cli
