# SPDX-License-Identifier: BSD-3-Clause
"""Finds the functions of C++ sources as clang-format lays them out."""
import re
from typing import NamedTuple

_BLANKED = re.compile(r'//[^\n]*|/\*.*?\*/|R"\((?:.|\n)*?\)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
# A macro call on a line of its own, without a semicolon.
_MACRO_LINES = re.compile(r"(?:\s*[A-Z][A-Z0-9_]+\([^(){}]*\)[ \t]*\n)+(?=\s*\S)")
_OPERATOR = re.compile(r"\boperator\s*(?:\(\)|[^\s\w(]+)")
_SCOPE = re.compile(r"\s*(?:template\s*<.*>\s*)?(?:inline\s+)?(?:namespace\b|extern\b|(?:struct|class|union|enum)\b)", re.S)


class Function(NamedTuple):
    name: str
    first: int  # line of its head, counted from 0
    opening: int  # line with the opening brace of its body
    last: int  # line with the closing brace
    parameters: int


def without_text(source):
    """Comments and strings as spaces, so that every character keeps its line and column."""
    return _BLANKED.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), source)


def parameters(head):
    """Number of parameters of the function whose text up to its body is `head`."""
    head = _OPERATOR.sub(lambda m: "f" * len(m.group()), head)
    depth = angles = commas = 0
    named = filled = False
    for at, c in enumerate(head):
        if c in "([{":
            named = named or (c == "(" and angles == 0 and bool(re.search(r"\w\s*$", head[:at])))
            depth += 1 if named else 0
        elif c in ")]}" and named:
            depth -= 1
            if depth == 0:
                break
        elif c in "<>" and head[at - 1] != "-":
            angles += 1 if c == "<" else -1
        elif c == "," and depth == 1 and angles == 0:
            commas += 1
        filled = filled or (depth > 0 and c not in "( \n")
    return commas + 1 if filled else 0


def functions(source):
    """Functions at namespace or class level, in the order of their ends."""
    code = re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", lambda m: re.sub(r"[^\n]", " ", m.group()), without_text(source),
                  flags=re.M)
    found, stack, start = [], [], 0
    for at, c in enumerate(code):
        if c == ";" and not (stack and stack[-1][0] == "body"):
            start = at + 1
        elif c == "{":
            if stack and stack[-1][0] == "body":
                stack.append(("body", None))
                continue
            macros = _MACRO_LINES.match(code, start, at)
            start = macros.end() if macros else start
            head = code[start:at]
            unfinished = head.count("(") > head.count(")")  # within the parameters
            if unfinished or (at > 0 and not code[at - 1].isspace()):
                stack.append(("value", None))
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
                found.append(Function(name.group(1) if name else "?", function[1], function[2],
                                      code.count("\n", 0, at), parameters(function[0])))
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
