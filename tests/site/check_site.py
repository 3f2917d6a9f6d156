#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds the site and follows its links: check_site.py BUILD. Exit code 77 without mkdocs."""
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """Links and anchors of a page."""

    def __init__(self, file):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        named = dict(attributes)
        self.links += [named[key] for key in ("href", "src") if named.get(key)]
        self.anchors |= {named[key] for key in ("id", "name") if named.get(key)}


def check_links(site):
    pages = {file: Page(file) for file in site.rglob("*.html") if file.name != "404.html"}
    problems = []
    for file, page in pages.items():
        for link in page.links:
            parts = urlsplit(link)
            if parts.scheme or parts.netloc or not (parts.path or parts.fragment):
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            if target.is_dir():
                target = target / "index.html"
            if not target.exists():
                problems.append(f"{file.relative_to(site)}: {link} is not there")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                problems.append(f"{file.relative_to(site)}: {link} has no such heading")
    return problems, len(pages)


def main(build):
    if shutil.which("mkdocs") is None:
        print("mkdocs is not installed (scripts/install-deps --judges)")
        return 77
    subprocess.run(["cmake", "--build", str(build), "--target", "site"], check=True, stdout=subprocess.DEVNULL)
    problems, pages = check_links(build / "site")
    assert (build / "site" / "search" / "search_index.json").stat().st_size > 100000, "there is nothing to search in"
    print("\n".join([*problems, f"{pages} pages, {len(problems)} problems"]))
    return 1 if problems or pages < 40 else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
