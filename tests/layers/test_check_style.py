#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The check of style, tried on made-up sources."""
import tempfile
import unittest
from pathlib import Path

import check_style
from cpp_functions import functions, longest_run


def function(lines, name="f"):
    return f"int {name}(int x) {{\n" + "".join(f"{line}\n" for line in lines) + "}\n"


class FindFunctions(unittest.TestCase):
    def test_finds_definitions_only(self):
        source = """
namespace a {
struct S {
  S(int x) : x_{x}, y_(x) {
    use(x);
  }
  int get() const { return x_; }
  int x_ = {3}, y_;
};
const int kTable[] = {1, 2, 3};
template <typename T>
T twice(T x) {
  auto lambda = [&] { return x; };
  if (x) { x = 2 * x; }  // f(y) {
  return lambda();
}
}  // namespace a
"""
        self.assertEqual([f.name for f in functions(source)], ["S", "get", "twice"])

    def test_text_does_not_count(self):
        self.assertEqual(functions('const char* const kText = "f() {";\n// g() {\n'), [])

    def test_longest_run(self):
        source = function(["  a();"] * 4 + [""] + ["  b();"] * 7)
        self.assertEqual(longest_run(source.splitlines(), functions(source)[0]), 7)


class CheckStyle(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def check(self, source):
        file = self.root / "src" / "core" / "a.cpp"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(source)
        return check_style.check(self.root)[0]

    def test_walls_of_text_are_found(self):
        wall = function(["  a();"] * 25)
        paragraphs = function((["  a();"] * 6 + [""]) * 4)
        self.assertTrue(any("25 lines without a blank one" in p for p in self.check(wall)))
        self.assertEqual(self.check(paragraphs), [])
        self.assertEqual(self.check(wall + paragraphs * 4), [])
        self.assertNotEqual(self.check(wall + paragraphs * 3), [])

    def test_short_functions_do_not_count(self):
        self.assertEqual(self.check(function(["  a();"] * 17)), [])

    def test_comments_that_begin_so_are_found(self):
        self.assertTrue(self.check("/// What it is.\nint x;\n"))
        self.assertTrue(self.check("int x;  ///< Those that are\n"))
        self.assertEqual(self.check('/// It is that.\n/// What follows, goes on.\nconst char* x = "// What";\n'), [])


if __name__ == "__main__":
    unittest.main()
