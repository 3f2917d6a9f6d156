// SPDX-License-Identifier: BSD-3-Clause
// The scripts ask the program itself (`plumbline complete`), so that they know what it knows. It answers with
// a line "files", "folders" or "none", "open" behind it when the word goes on, and a line for each candidate:
// word, tab, help.
#include <fmt/format.h>

#include "reference/completion.hpp"

namespace plumbline::cli {
namespace {

const char* const kBash = R"(# bash completion for plumbline: plumbline completion bash
_plumbline() {
  local word=${COMP_WORDS[COMP_CWORD]} first line
  [[ $word == [=:] ]] && word=
  COMPREPLY=()
  {
    read -r first || return
    while IFS=$'\t' read -r line _; do
      [[ -n $line ]] && COMPREPLY+=("$line")
    done
  } < <("$1" complete --line "${COMP_LINE:0:COMP_POINT}" --word "$word" 2>/dev/null)
  case $first in
    files*) compopt -o filenames; mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -- "$word") ;;
    folders*) compopt -o filenames; mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -d -- "$word") ;;
  esac
  [[ $first == *open ]] && compopt -o nospace
}
complete -F _plumbline plumbline
)";

const char* const kZsh = R"(#compdef plumbline
# zsh completion for plumbline: plumbline completion zsh
_plumbline() {
  local -a lines candidates shown blank
  local line first
  lines=("${(@f)$("${(Q)words[1]}" complete -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)}")
  first=${lines[1]}
  [[ $first == *open ]] && blank=(-S '')
  for line in "${(@)lines[2,-1]}"; do
    [[ -z $line ]] && continue
    candidates+=("${line%%$'\t'*}")
    shown+=("${line%%$'\t'*}  ${line#*$'\t'}")
  done
  (( $#candidates )) && compadd -l "${blank[@]}" -d shown -a candidates
  case $first in
    files*) _files ;;
    folders*) _files -/ ;;
  esac
}
if [[ $funcstack[1] == _plumbline ]]; then
  _plumbline "$@"
else
  compdef _plumbline plumbline
fi
)";

const char* const kFish = R"(# fish completion for plumbline: plumbline completion fish
function __plumbline_complete
    set -l words (commandline -opc) (commandline -ct)
    set -l lines (command $words[1] complete -- $words[2..-1] 2>/dev/null)
    for line in $lines[2..-1]
        echo $line
    end
    switch "$lines[1]"
        case 'files*'
            __fish_complete_path (commandline -ct)
        case 'folders*'
            __fish_complete_directories (commandline -ct)
    end
end
complete -c plumbline -f -a '(__plumbline_complete)'
)";

}  // namespace

core::Result<std::string> completion_script(const std::string& shell) {
  if (shell == "bash") return kBash;
  if (shell == "zsh") return kZsh;
  if (shell == "fish") return kFish;
  return core::usage_error(fmt::format("there is no completion for '{}' (allowed: bash, zsh, fish)", shell));
}

}  // namespace plumbline::cli
