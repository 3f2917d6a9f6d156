#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The check of style, tried on made-up sources."""
import tempfile
import unittest
from pathlib import Path

import check_style
from cpp_functions import functions, longest_run, parameters


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

    def test_macro_calls_are_no_part_of_what_follows(self):
        source = "INIT(a)\nINIT(b)\n\nnamespace c {\nvoid f() {\n}\n}\nINIT(d)\nint g() {\n}\nTEST(A, B) {\n}\n"
        self.assertEqual([(f.name, f.first) for f in functions(source)], [("f", 4), ("g", 8), ("TEST", 10)])

    def test_parameters(self):
        heads = {"void f()": 0, "void f(int)": 1, "int S::f(int a, int b) const": 2,
                 "S(int a, std::map<int, int> b) : a_(a), b_{b, 1}": 2,
                 "std::function<void(int, int)> f(std::array<int, 2> a = {1, 2}, int b = g(1, 2))": 2,
                 "template <typename T, typename U>\nauto f(const T& a,\n       U b) -> std::pair<T, U>": 2,
                 "bool operator()(int a, int b) const": 2, "bool operator<(const S& o) const": 1,
                 "void f(const std::function<bool(int, int)>& a, int b)": 2}
        for head, count in heads.items():
            self.assertEqual(parameters(head), count, head)
            self.assertEqual([f.parameters for f in functions(head + " {\n}\n")], [count], head)

    def test_longest_run(self):
        source = function(["  a();"] * 4 + [""] + ["  b();"] * 7)
        self.assertEqual(longest_run(source.splitlines(), functions(source)[0]), 7)


class CheckStyle(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)

    def check(self, source, module="core"):
        file = self.root / "src" / module / "a.cpp"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(source)
        return check_style.check(self.root)[0]

    def test_walls_of_text_are_found(self):
        wall = function(["  // Heading"] + ["  a();"] * 24)
        paragraphs = function(["  // Heading"] + (["  a();"] * 6 + [""]) * 4)
        self.assertTrue(any("25 lines without a blank one" in p for p in self.check(wall)))
        self.assertEqual(self.check(paragraphs), [])
        self.assertEqual(self.check(wall + paragraphs * 4), [])
        self.assertNotEqual(self.check(wall + paragraphs * 3), [])

    def test_short_functions_do_not_count(self):
        self.assertEqual(self.check("/// Above.\n" + function(["  a();"] * 17)), [])

    def test_long_functions_are_found(self):
        def lines(count):
            return ["  // Heading"] + ["  a();", ""] * (count // 2)
        self.assertEqual(self.check(function(lines(56))), [])
        self.assertTrue(any("61 lines; 60 at most" in p for p in self.check(function(lines(58)))))
        self.assertEqual(self.check(function(lines(58), next(iter(check_style.TABLES)))), [])

    def test_many_parameters_are_found(self):
        def takes(count):
            return "int f(" + ", ".join(f"int p{k}" for k in range(count)) + ") {\n}\n"
        self.assertEqual(self.check(takes(6)), [])
        self.assertTrue(any("7 parameters" in p for p in self.check(takes(7))))

    def test_modules_may_keep_their_exceptions_but_not_add_any(self):
        wide = "int f(" + ", ".join(f"int p{k}" for k in range(7)) + ") {\n}\n"
        module, most = next(iter(check_style.MORE_PARAMETERS.items()))
        self.assertEqual(self.check(wide * most, module), [])
        self.assertEqual(len(self.check(wide * (most + 1), module)), most + 1)

    def test_functions_without_headings_are_found(self):
        bare = "/// Above.\n" + function(["  a();", ""] * 10)
        headed = function(["  // Heading"] + ["  a();", ""] * 10)
        self.assertEqual(self.check(bare + headed), [])
        self.assertTrue(any("0.33 of its long functions" in p for p in self.check(bare * 2 + headed)))

    def test_functions_without_words_are_found(self):
        bare = function(["  a();"] * 6)
        above = "/// Above.\n" + bare + "\n" * 3
        inside = function(["  // Inside", "  b();"] + ["  a();"] * 4)
        self.assertEqual(self.check(above * 2 + inside + bare), [])
        self.assertTrue(any("1 of 3 functions" in p for p in self.check(above + inside + bare)))
        self.assertEqual(self.check(function(["  a();"] * 5)), [])

    def test_headings_that_repeat_the_call_are_found(self):
        def headed(heading, line):
            return self.check(function([f"  // {heading}", f"  {line}"]))
        for heading, line in [("Write the header", "write_header(out);"), ("Reading of points", "readPoints(file);"),
                              ("Sorted", "std::sort(a.begin(), a.end());")]:
            self.assertTrue(any("repeats the call" in p for p in headed(heading, line)), heading)
        for heading, line in [("The header comes first", "write_header(out);"), ("Count", "int count = 0;"),
                              ("Write the header", 'f("write header");')]:
            self.assertEqual(headed(heading, line), [], heading)

    def test_comments_that_begin_so_are_found(self):
        self.assertTrue(self.check("/// What it is.\nint x;\n"))
        self.assertTrue(self.check("int x;  ///< Those that are\n"))
        self.assertEqual(self.check('/// It is that.\n/// What follows, goes on.\nconst char* x = "// What";\n'), [])


if __name__ == "__main__":
    unittest.main()
