#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The runner of the pages, tried on made-up ones."""
import contextlib
import io
import os
import tempfile
import unittest
from pathlib import Path

import run_pages


class RunPages(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        (self.root / "docs" / "guide").mkdir(parents=True)
        self.program = self.root / "bin" / "plumbline"
        self.program.parent.mkdir()
        self.program.write_text('#!/bin/sh\necho "$@" >> told.txt\n[ "$1" != fail ]\n')
        os.chmod(self.program, 0o755)

    def run_page(self, text):
        (self.root / "docs" / "guide" / "a.md").write_text(text)
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            code = run_pages.main(self.root, str(self.program), self.root / "work")
        return code, out.getvalue()

    def told(self):
        return (self.root / "work" / "told.txt").read_text()

    def test_blocks_are_run_and_files_written(self):
        code, out = self.run_page("# A\n\n<!-- file: x.yaml -->\n```yaml\na: 1\n```\n<!-- append: x.yaml -->\n"
                                  "```yaml\nb: 2\n```\n\n```sh\nplumbline map x.yaml  # words\nplumbline info\n```\n"
                                  "```\nwhat is printed\n```\n")
        self.assertEqual(code, 0, out)
        self.assertEqual(self.told(), "map x.yaml\ninfo\n")
        self.assertEqual((self.root / "work" / "x.yaml").read_text(), "a: 1\nb: 2\n")

    def test_a_command_that_fails(self):
        code, out = self.run_page("words\n\n```sh\nplumbline fail\nplumbline info\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("a.md:4: exit code 1", out)
        self.assertEqual(self.told(), "fail\n")

    def test_what_is_not_run_has_a_reason(self):
        code, out = self.run_page("<!-- not run: needs two machines -->\n```sh\nplumbline fail\n```\n")
        self.assertEqual((code, "skipped, needs two machines" in out), (0, True), out)
        code, out = self.run_page("```\nplumbline map\n```\n")
        self.assertEqual((code, "a.md:2: is no ```sh block" in out), (1, True), out)

    def test_files_that_no_page_tells_of(self):
        (self.root / "docs" / "reference").mkdir()
        (self.root / "docs" / "reference" / "files.md").write_text(
            "`frames.csv` `keyframes.csv` `summary.json` `frame`, `stamp` `snapshots/*.png` `input`")
        result = self.root / "out" / "room"
        (result / "snapshots").mkdir(parents=True)
        (result / "frames.csv").write_text("frame,stamp,odd\n0,1,2\n")
        (result / "keyframes.csv").write_text("frame\n")
        (result / "summary.json").write_text('{"input": "a", "more": 1}')
        self.assertEqual(run_pages.check_files(self.root, self.root),
                         ["docs/reference/files.md: does not tell of more, which out/room has",
                          "docs/reference/files.md: does not tell of odd, which out/room has"])

    def test_recordings_are_small(self):
        self.assertEqual(run_pages.small("plumbline synth room -o w --frames 900  # x\nplumbline synth plane -o p\n"),
                         "plumbline synth room -o w --frames 80 --width 320 --height 240\n"
                         "plumbline synth plane -o p --width 320 --height 240 --frames 80\n")
        self.assertEqual(run_pages.small('plumbline map "synth:room?frames=30&seed=1" -o a'),
                         'plumbline map "synth:room?width=320&height=240&frames=30&seed=1" -o a')
        self.assertEqual(run_pages.small("plumbline hub -o b"), "plumbline hub --domain 217 -o b")


if __name__ == "__main__":
    unittest.main()
