// SPDX-License-Identifier: BSD-3-Clause
// embed OUT.cpp FILE...: the page's scripts (*.js), shaders (*.vert, *.frag) and style (*.css) as constants
// of C++, without comments and needless blanks. Runs when the program is built.
#include <cctype>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>

namespace {

std::string ending(const std::string& name) { return name.substr(name.find_last_of('.') + 1); }
std::string base(const std::string& name) { return name.substr(name.find_last_of('/') + 1); }

/// Whether two letters would become one word.
bool sticks(char a, char b) {
  const auto word = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '$';
  };
  return (word(a) && word(b)) || (a == b && (a == '+' || a == '-' || a == '/'));
}

/// End of a literal that begins at `from`: a string, or a template with what is computed in it.
std::size_t end_of_literal(const std::string& text, std::size_t from) {
  const char quote = text[from];
  std::size_t i = from + 1;

  while (i < text.size() && text[i] != quote) {
    if (text[i] == '\\') {
      i += 2;

    } else if (quote == '`' && text.compare(i, 2, "${") == 0) {
      int depth = 1;
      for (i += 2; i < text.size() && depth > 0; ++i) {
        if (text[i] == '`' || text[i] == '\'') {
          i = end_of_literal(text, i) - 1;
        } else {
          depth += text[i] == '{' ? 1 : text[i] == '}' ? -1 : 0;
        }
      }

    } else {
      ++i;
    }
  }

  return i + 1;
}

/// Whether a '/' behind this letter begins a pattern, not a division.
bool before_pattern(char c) { return std::string("(,=:[!&|?{};\n").find(c) != std::string::npos; }

std::size_t end_of_pattern(const std::string& text, std::size_t from) {
  bool set = false;
  std::size_t i = from + 1;
  for (; i < text.size() && (set || text[i] != '/'); ++i) {
    if (text[i] == '\\') ++i;
    if (text[i] == '[') set = true;
    if (text[i] == ']') set = false;
  }
  return i + 1;
}

/// In scripts const becomes let. Scripts keep their lines: a line's end may end a statement. Shaders keep
/// those that begin with '#'.
std::string shortened(const std::string& text, const std::string& kind) {
  std::string out;
  bool blank = false;
  const bool script = kind == "js";
  for (std::size_t i = 0; i < text.size();) {
    const char c = text[i];
    const char last = out.empty() ? '\n' : out.back();

    // Comments go, blanks and line breaks as far as they mean nothing.
    if (text.compare(i, 2, "/*") == 0) {
      i = text.find("*/", i) + 2;
      blank = true;
    } else if (kind != "css" && text.compare(i, 2, "//") == 0) {
      i = text.find('\n', i);
    } else if (std::isspace(static_cast<unsigned char>(c)) != 0) {
      const std::size_t line = out.find_last_of("\n") + 1;  // npos + 1 is 0
      const bool directive = !script && line < out.size() && out[line] == '#';
      if (c == '\n' && last != '\n' && (script || directive)) {
        while (!out.empty() && out.back() == ' ') out.pop_back();
        // Behind these a statement cannot have ended.
        if (directive || std::string(",;{([=&|?:").find(out.back()) == std::string::npos) out += '\n';
      }
      blank = true;
      ++i;

    } else {
      // Literals and patterns are copied whole.
      const bool literal = script && (c == '\'' || c == '"' || c == '`');
      const bool pattern = script && c == '/' && before_pattern(last);
      const bool word =
          script && !sticks(last, 'x') && text.compare(i, 5, "const") == 0 && !sticks(text[i + 5], 'x');
      const std::size_t to = word      ? i + 5
                             : literal ? end_of_literal(text, i)
                             : pattern ? end_of_pattern(text, i)
                                       : i + 1;

      // In styles a blank between other letters has a meaning.
      const bool needed = kind == "css" && std::string(">+~{}:;,()").find(c) == std::string::npos &&
                          std::string("{};:,>").find(last) == std::string::npos;

      // A semicolon or a line break in front of a closing bracket ends nothing that the bracket does not end.
      if (script && c == '}' && last == ';') out.pop_back();
      if (script && last == '\n' && out.size() > 1 && std::string("}).]").find(c) != std::string::npos)
        out.pop_back();

      if (blank && last != '\n' && (sticks(last, c) || needed || (kind == "css" && (c == ':' || c == '('))))
        out += ' ';
      out += word ? "let" : text.substr(i, to - i);
      blank = false;
      i = to;
    }
  }
  return out;
}

/// A literal of C++ for text of any length.
void put(std::ostream& out, const std::string& text) {
  constexpr std::size_t kPiece = 8000;  // letters, at most, that every compiler takes
  for (std::size_t i = 0; i < text.size(); i += kPiece)
    out << "R\"page(" << text.substr(i, kPiece) << ")page\"\n";
}

}  // namespace

int main(int count, char** names) {
  std::string scripts;
  std::string live;
  std::string shaders;
  std::string style;
  for (int i = 2; i < count; ++i) {
    std::ifstream file(names[i]);
    const std::string text(std::istreambuf_iterator<char>(file), {});
    if (!file || text.empty()) {
      std::cerr << "embed: cannot read " << names[i] << '\n';
      return 1;
    }

    const std::string kind = ending(names[i]);
    const std::string shorter = shortened(text, kind);
    if (kind == "js") (base(names[i]) == "live.js" ? live : scripts) += shorter;
    if (kind == "css") style += shorter;
    if (kind == "vert" || kind == "frag") shaders += "'" + base(names[i]) + "':`" + shorter + "`,\n";
  }

  std::ofstream out(names[1]);
  out << "// Made by viz/viewer/embed.\n#include \"sources.hpp\"\nnamespace plumbline::viewer {\nconst char* "
         "const kScript =\n";
  put(out, "(()=>{'use strict';\nconst kShaders={\n" + shaders + "};\n" + scripts);
  out << ";\nconst char* const kLiveScript =\n";
  put(out, live);
  out << ";\nconst char* const kStyle =\n";
  put(out, style + "\n");
  out << ";\n}  // namespace plumbline::viewer\n";
  return out.flush() ? 0 : 1;
}
