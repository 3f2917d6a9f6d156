# SPDX-License-Identifier: BSD-3-Clause
"""Finds the functions of C++ sources as clang-format lays them out."""
import re
from typing import NamedTuple

_BLANKED = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
_SCOPE = re.compile(r"\s*(?:template\s*<.*>\s*)?(?:inline\s+)?(?:namespace\b|extern\b|(?:struct|class|union|enum)\b)", re.S)


class Function(NamedTuple):
    name: str
    first: int  # line of its head, counted from 0
    opening: int  # line with the opening brace of its body
    last: int  # line with the closing brace


def without_text(source):
    """Comments and strings as spaces, so that every character keeps its line and column."""
    return _BLANKED.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), source)


def functions(source):
    """Functions at namespace or class level, in the order of their ends."""
    code = re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", lambda m: re.sub(r"[^\n]", " ", m.group()), without_text(source),
                  flags=re.M)
    found, stack, start = [], [], 0
    for at, c in enumerate(code):
        if c == ";" and not (stack and stack[-1][0] == "body"):
            start = at + 1
        elif c == "{":
            head = code[start:at]
            inside = bool(stack) and stack[-1][0] == "body"
            initializer = at > 0 and not code[at - 1].isspace()
            if inside or initializer:
                stack.append(("body" if inside else "value", None))
                continue
            if _SCOPE.match(head) and not re.search(r"\)\s*(?:const|noexcept|override|final|\s)*$", head):
                stack.append(("scope", None))
            elif ")" in head:
                first = start + len(head) - len(head.lstrip())
                stack.append(("body", (head, code.count("\n", 0, first), code.count("\n", 0, at))))
            else:
                stack.append(("value", None))
            if stack[-1][0] != "value":
                start = at + 1
        elif c == "}" and stack:
            kind, function = stack.pop()
            if function:
                name = re.search(r"([\w:~]+|operator\S+)\s*\(", function[0])
                found.append(Function(name.group(1) if name else "?", function[1], function[2], code.count("\n", 0, at)))
            if kind != "value" and not (stack and stack[-1][0] == "body"):
                start = at + 1
    return found


def longest_run(lines, function):
    """Longest run of lines of a function's body without a blank one."""
    longest = run = 0
    for line in lines[function.opening + 1:function.last]:
        run = run + 1 if line.strip() else 0
        longest = max(longest, run)
    return longest
