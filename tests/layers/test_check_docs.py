#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The check of the pages, tried on made-up ones."""
import tempfile
import unittest
from pathlib import Path

import check_docs

HELP = {
    ("map",): "map INPUT -o,--output OUT --every N",
    ("evaluate",): "Usage: evaluate SUBCOMMAND\n\nSubcommands:\n  cloud       Accuracy of a cloud\n",
    ("evaluate", "cloud"): "--align none|se3",
    # A program may show the group's help when it does not know the word.
    ("evaluate", "smell"): "Usage: evaluate SUBCOMMAND\n",
}


class CheckDocs(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        (self.root / "docs" / "notes").mkdir(parents=True)
        (self.root / "docs" / "guide").mkdir()
        self.write("docs/README.md", "[a](a.md) [up](../README.md#a-place-here) [notes](notes/README.md) "
                   "[web](https://example.org/x)\n")
        self.write("docs/a.md", "words\n")
        self.write("docs/notes/README.md", "[old](old.md)\n")
        self.write("docs/notes/old.md", "```\nplumbline gone\n```\n")
        self.write("README.md", "[docs](docs/README.md)\n\n## A place, here\n\n"
                   "```\nplumbline map IN -o OUT --every 2  # --nonsense\n"
                   "build/release/bin/plumbline evaluate cloud C --align se3\nplumb x\n```\n")

    def write(self, path, text):
        (self.root / path).write_text(text)

    def problems(self):
        return check_docs.check(self.root, lambda command: HELP.get(tuple(command)))

    def test_good_pages_pass(self):
        self.assertEqual(self.problems(), [])
        self.assertEqual(len(list(check_docs.commands((self.root / "README.md").read_text()))), 2)

    def test_dead_link(self):
        self.write("docs/a.md", "words\n[b](b.png)\n")
        self.assertEqual(self.problems(), ["docs/a.md:2: b.png is not there"])

    def test_dead_heading(self):
        self.write("docs/a.md", "# Words\n\n[b](#words) [c](#wards) [d](../README.md#a-place)\n")
        self.assertEqual(self.problems(), ["docs/a.md:3:  has no heading #wards",
                                           "docs/a.md:3: ../README.md has no heading #a-place"])

    def test_source_that_names_a_page_that_is_gone(self):
        (self.root / "src").mkdir()
        self.write("src/a.cpp", "// docs/a.md\n// docs/old/b.md\n")
        self.assertEqual(self.problems(), ["src/a.cpp:2: docs/old/b.md is not there"])

    def test_guide_that_is_too_long(self):
        self.write("docs/README.md", "[a](a.md) [notes](notes/README.md) [b](guide/b.md)\n")
        self.write("docs/guide/b.md", "words\n" * 2001)
        self.assertEqual(self.problems(), ["docs/guide: 2001 lines; 2000 at most"])

    def test_layout_without_a_row(self):
        before, HELP[("map",)] = HELP[("map",)], HELP[("map",)] + " --format TEXT:{auto,tum,mine} Layout"
        self.addCleanup(HELP.__setitem__, ("map",), before)
        self.write("docs/README.md", "[a](a.md) [notes](notes/README.md) [b](guide/inputs.md)\n")
        self.write("docs/guide/inputs.md", "| `tum` | a folder |\n")
        self.assertEqual(self.problems(), ["docs/guide/inputs.md: there is no row for --format mine"])

    def test_page_that_is_not_listed(self):
        self.write("docs/b.md", "words\n")
        self.assertEqual(self.problems(), ["docs/README.md:1: does not list b.md"])

    def test_command_that_is_not_there(self):
        self.write("docs/a.md", "```sh\nplumbline fly\nplumbline evaluate smell\n```\n")
        self.assertEqual(self.problems(), ["docs/a.md:2: there is no command 'plumbline fly'",
                                           "docs/a.md:3: there is no command 'plumbline evaluate smell'"])

    def test_flag_that_is_not_there(self):
        self.write("docs/a.md", "```\nplumbline map IN --ever 2\nplumbline evaluate cloud --every=3\n```\n")
        self.assertEqual(self.problems(), ["docs/a.md:2: plumbline map has no --ever",
                                           "docs/a.md:3: plumbline evaluate cloud has no --every"])

    def test_group_without_command(self):
        self.write("docs/a.md", "```\nplumbline evaluate\nplumbline evaluate --align se3\n```\n")
        self.assertEqual(self.problems(), ["docs/a.md:3: plumbline evaluate has no --align"])


if __name__ == "__main__":
    unittest.main()
