#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Gathers the pages for a site or a package: site_pages.py ROOT OUT [VERSION] writes OUT/pages, with VERSION OUT/mkdocs.yml, too.

Pages keep their places below ROOT, so that their links hold. Files that pages link to come along; a folder that they link to
and that has no README.md becomes a page that lists it. The order of the pages is that of docs/README.md.
"""
import json
import re
import shutil
import sys
from pathlib import Path

LINK = re.compile(r"(\]\()([^)#\s]+)(#[^)\s]+)?(\))")
TOP = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"]


def title_of(page):
    heading = re.search(r"^# (.+)$", page.read_text(), re.M)
    return heading.group(1) if heading else page.stem


def list_folder(root, folder, pages):
    """A page for a folder of the source, with its files beside it."""
    name = folder.relative_to(root)
    (pages / name).mkdir(parents=True, exist_ok=True)
    lines = [f"# {name}", ""]
    for file in sorted(folder.iterdir()):
        if file.is_file() and file.name != "README.md":
            shutil.copy(file, pages / name / file.name)
            lines.append(f"* [{file.name}]({file.name})")
        elif file.is_dir():
            lines.append(f"* {file.name}/")
    (pages / name / "README.md").write_text("\n".join(lines) + "\n")


def copy_page(root, page, pages):
    """The page with its links; what these name comes along."""
    def follow(match):
        target = match.group(2)
        if re.match(r"[a-z]+:", target):
            return match.group(0)
        linked = (page.parent / target).resolve()
        if linked.is_dir():
            if not (linked / "README.md").exists():
                list_folder(root, linked, pages)
            target = target.rstrip("/") + "/README.md"
            linked = linked / "README.md"
        place = pages / linked.relative_to(root)
        if not place.exists() and linked.suffix == ".md":
            copy_page(root, linked, pages)
        elif not place.exists():
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(linked, place)
        return match.group(1) + target + (match.group(3) or "") + match.group(4)

    place = pages / page.relative_to(root)
    place.parent.mkdir(parents=True, exist_ok=True)
    place.touch()  # pages that link to each other are not copied again
    place.write_text(LINK.sub(follow, page.read_text()))


def navigation(root):
    """Sections of docs/README.md with the pages of their tables."""
    index = (root / "docs" / "README.md").read_text()
    nav = [{"Plumbline": "README.md"}, {"All pages": "docs/README.md"}]
    for section in re.split(r"^## ", index, flags=re.M)[1:]:
        name = section.splitlines()[0]
        pages = re.findall(r"^\| \[[^\]]+\]\(([^)]+\.md)\)", section, re.M)
        if pages:
            nav.append({name: [{title_of(root / "docs" / page): f"docs/{page}"} for page in pages]})
    others = [{title_of(root / page): page} for page in TOP[1:]]
    notes = sorted((root / "docs" / "notes").glob("2*.md"), reverse=True)
    listed = [{"All notes": "docs/notes/README.md"}] + [{title_of(note): f"docs/notes/{note.name}"} for note in notes]
    return nav + [{"Notes": listed}, {"Limits": "docs/limits.md"}, {"Project": others}]


def gather(root, pages):
    pages.mkdir(parents=True)
    for page in [root / name for name in TOP] + sorted((root / "docs").rglob("*.md")):
        if not (pages / page.relative_to(root)).exists():
            copy_page(root, page, pages)
    for name in ("LICENSE", "CITATION.cff"):
        shutil.copy(root / name, pages / name)


def write_settings(root, out, version):
    settings = {
        "site_name": f"Plumbline {version}",
        "site_description": "RGB-D recordings in, one dense metric point cloud out",
        "docs_dir": "pages",
        "site_dir": "../site",
        "use_directory_urls": False,
        "theme": {"name": "material", "font": False, "features": ["navigation.indexes", "navigation.top"]},
        "plugins": ["search"],
        "markdown_extensions": ["tables", "fenced_code", "toc", "admonition", "pymdownx.highlight"],
        "nav": navigation(root),
    }
    (out / "mkdocs.yml").write_text(json.dumps(settings, indent=1))  # JSON is YAML


def main(root, out, version=None):
    shutil.rmtree(out, ignore_errors=True)
    gather(root, out / "pages")
    if version is not None:
        write_settings(root, out, version)
    return 0


if __name__ == "__main__":
    sys.exit(main(*(Path(folder).resolve() for folder in sys.argv[1:3]), *sys.argv[3:]))
