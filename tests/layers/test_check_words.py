#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The check of words, tried on made-up sources and pages."""
import tempfile
import unittest
from pathlib import Path

import check_words

HERE = Path(check_words.__file__)
WORDS = list(check_words.rules(HERE.with_name("words.txt")))
PHRASES = list(check_words.rules(HERE.with_name("phrases.txt")))


class CheckWords(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        for name in ["src/net/http", "src/cli", "viz", "docs/guide"]:
            (self.root / name).mkdir(parents=True)

    def write(self, path, text):
        (self.root / path).write_text(text)

    def found(self):
        """file:line of each offence, once"""
        return sorted({":".join(line.split(":")[:2]) for line in check_words.check(self.root, WORDS, PHRASES)})

    def test_good_words_pass(self):
        self.write("src/a.cpp", "/// True if the camera is lost.\nbool lost();\n"
                   "// Where the support leaves the image, the border's gradient goes on.\nint x;  ///< of colour\n"
                   'auto help = "Speed factor";  // What, if not this\n')
        self.write("docs/guide/a.md", "# What it does\n\nHow exact it is: see below.\n\n```\nstays on the rails\n```\n")
        self.write("README.md", "It does not get lost.\n")
        self.assertEqual(self.found(), ["src/a.cpp:5"])  # a comment at the end of a line is one as well

    def test_identifiers(self):
        self.write("src/net/a.cpp", 'int hello = 1;\nconst char* text = "hello";  // hello\nint welcome = hello;\n')
        self.assertEqual(self.found(), ["src/net/a.cpp:1"])

    def test_openings_of_comments(self):
        for opening in ["What it costs.", "Whether the camera is lost.", "Of the last frame.", "How it began.",
                        "Those that fit; all if none do.", "As the file says.", "Where the camera is", "So many fit."]:
            self.write("src/a.hpp", f"#pragma once\n\n/// {opening}\nint x;\n")
            self.assertEqual(self.found(), ["src/a.hpp:3"], opening)
            self.write("src/a.hpp", f"int x;  ///< {opening}\n")
            self.assertEqual(self.found(), ["src/a.hpp:1"], opening)

    def test_comment_that_goes_on(self):
        self.write("src/a.hpp", "/// The bundle knows\n/// What it costs.\nint x;\n")
        self.assertEqual(self.found(), [])
        self.write("src/a.hpp", "/// Landmarks of both maps that were taken for\n/// wrong before.\nint x;\n")
        self.assertEqual(self.found(), ["src/a.hpp:1"])

    def test_texts(self):
        self.write("src/cli/a.cpp", '#include "What is included.hpp"\n\nvoid f() {\n'
                   '  add_option("--speed", speed, "Times the scene\'s own speed");\n'
                   '  add_flag("--resume", resume,\n           "Go on from what a run left "\n'
                   '           "in OUT.partial");\n'
                   "  char quote = '\"';\n"
                   '  add_option("--name", name, "The robot\'s name, one of its own in the domain");\n'
                   '  error("{}: is no bag");\n  error("there is no stage");\n'
                   '  auto raw = R"(Of a stage)";\n}\n')
        self.assertEqual(self.found(), ["src/cli/a.cpp:10", "src/cli/a.cpp:12", "src/cli/a.cpp:4", "src/cli/a.cpp:6",
                                        "src/cli/a.cpp:9"])

    def test_pages(self):
        self.write("README.md", "# Plumbline\n\nSo that it stays\non the rails.\n")
        self.write("docs/guide/a.md", "| `--wait` | for a hub that was\never heard |\n| b | a hub that was heard |\n"
                   "* good\n* A wish that lasts\n")
        self.assertEqual(self.found(), ["README.md:3", "docs/guide/a.md:3", "docs/guide/a.md:5"])

    def test_rules(self):
        self.write("docs/rules.txt", "# a comment\n\nfoo  # bar  @ comment src !src/net\n")
        self.assertEqual(list(check_words.rules(self.root / "docs/rules.txt")),
                         [("foo", "bar", ["comment", "src", "!src/net"])])
        self.write("docs/rules.txt", "not_yet = src/a viz/b\nfoo  # bar  @ text !not_yet !src/c\n")
        self.assertEqual(list(check_words.rules(self.root / "docs/rules.txt")),
                         [("foo", "bar", ["text", "!src/a", "!viz/b", "!src/c"])])
        self.write("docs/rules.txt", "foo\n")
        with self.assertRaises(ValueError):
            list(check_words.rules(self.root / "docs/rules.txt"))

    def test_every_rule_is_an_expression(self):
        for pattern, instead, _ in WORDS + PHRASES:
            check_words.re.compile(pattern)
            self.assertTrue(instead, pattern)


if __name__ == "__main__":
    unittest.main()
