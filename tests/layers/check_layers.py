#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that the code keeps to its layers.

check_layers.py ROOT prints every offence as "file:line: what is wrong" and returns 1 if there is one.
Includes and CMake dependencies must point to lower layers only, heavy libraries stay in their one module,
libraries leave the process alone (no printing, no exit, no environment), every file has its SPDX line.
"""
import os
import re
import sys
from pathlib import Path

# Lowest first. Modules of one layer do not see each other.
LAYERS = [
    ["core"],
    ["geometry"],
    ["sensor"],
    ["dataset", "features", "diagnose", "cloud", "optimize"],
    ["maps"],
    ["tracking", "places", "evaluate", "synth", "viewer", "check"],
    ["mapping", "inertial", "plans"],
    ["viz", "exports", "localize"],
    ["adjust", "changes"],
    ["pipeline", "report"],
    ["session"],
    ["net"],
    ["cli", "python"],
]
LAYER_OF = {module: height for height, layer in enumerate(LAYERS) for module in layer}
# Folders of a module that must not see another one: who runs a graph knows no stage.
BLIND = {"pipeline": [("run", "stages"), ("graph", "stages")]}
FOLDERS = {"maps": "maps", "viz": "viz", "report": "viz/report", "viewer": "viz/viewer"}  # of modules that are not below src/

# A library that only these modules may include or link. Both patterns match from the start of the name.
CONFINED = [
    ("VTK", ["viz"], r"vtk", r"VTK|vtk"),
    ("Ceres", ["optimize"], r"ceres/", r"Ceres::|ceres\b"),
    ("yaml-cpp", ["core"], r"yaml-cpp/", r"yaml-cpp"),
    ("CycloneDDS", ["dataset", "net"], r"dds/|ddsc/|org/eclipse/cyclonedds", r"CycloneDDS"),
    ("SQLite", ["dataset", "maps"], r"sqlite3", r"SQLite3?::|sqlite3\b"),
    ("CLI11", ["cli"], r"CLI/", r"CLI11"),
]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
OWN = re.compile(r"plumbline/([a-z]+)/")
# What a library must leave to the program; `allowed` are the files whose very job it is.
FORBIDDEN = [
    (re.compile(r"\bstd::(cout|cerr|clog)\b|(?<![\w.>])(std::)?(f?printf|puts)\s*\(|\bfmt::print\s*\("),
     "libraries do not print"),
    (re.compile(r"(?<![\w.>:])(std::)?(_?exit|quick_exit|abort)\s*\("), "libraries do not end the process"),
    (re.compile(r"(?<![\w.>:])(std::)?(secure_)?getenv\s*\("), "libraries do not read the environment"),
    (re.compile(r"\bstd::(rand|srand|random_device)\b|(?<![\w.>:])s?rand\s*\("),
     "random choices take a seed"),
]
# What only one file may do, in the program as well: the file, what it alone may call, and what the others call.
ALONE = [
    ("src/core/json.cpp", re.compile(r"\b[Jj]son::(parse|sax_parse|accept)\b|>>\s*[jJ]son\b"),
     "JSON is read by core::read_json and core::parse_json, which bound it"),
    ("src/core/json.cpp", re.compile(r"\.dump\("), "JSON is written by core::json_text, which is valid for any name"),
]
PROGRAM = {"cli"}
CODE = {".cpp", ".hpp", ".h", ".c"}
SPDX = "SPDX-License-Identifier: BSD-3-Clause"
SPDX_SUFFIXES = CODE | {".cmake", ".py", ".yaml", ".idl"}
SKIPPED = {"build", "out", "demo", ".git", ".cache"}
CORPORA = Path("tests/fuzz/corpus")  # inputs byte for byte: a line more would exercise something else


def folder_of(module):
    return Path(FOLDERS.get(module, f"src/{module}"))


def code_of(root, module):
    """All source files of a module, public headers included."""
    files = []
    for folder in (root / folder_of(module), root / "include" / "plumbline" / module):
        files += [f for f in folder.rglob("*") if f.suffix in CODE]
    inner = {root / folder_of(other) for other in FOLDERS if folder_of(module) in folder_of(other).parents}
    return sorted(f for f in files if not inner & set(f.parents))


def without_comment(line):
    return re.sub(r'"(\\.|[^"\\])*"', '""', line).split("//")[0]


def check_include(module, bracket, path, reachable):
    """What is wrong with one #include, or None."""
    own = OWN.match(path)
    if own:
        other = own.group(1)
        if other not in LAYER_OF:
            return f"includes {path}, whose module is in no layer"
        if other != module and LAYER_OF[other] >= LAYER_OF[module]:
            side = "its own layer" if LAYER_OF[other] == LAYER_OF[module] else "a higher layer"
            return f"{module} includes {path}, which is in {side}"
        if other != module and other not in reachable:
            return f"{module} includes {path} but does not depend on {other} in its CMakeLists.txt"
        return None
    if bracket == '"' and ".." in Path(path).parts:
        return f"includes {path}: only a module's own folder and public headers"
    for library, homes, header, _ in CONFINED:
        if module not in homes and re.match(header, path):
            return f"{module} includes {path}: {library} belongs to {' and '.join(homes)} only"
    return None


def read_cmake(root, module):
    """(modules it depends on, problems) of a module's CMakeLists.txt."""
    file = root / folder_of(module) / "CMakeLists.txt"
    if not file.is_file():
        return set(), [f"{file.relative_to(root)}:1: is missing"]
    depends, problems = set(), []
    text = re.sub(r"#[^\n]*", "", file.read_text())

    def where(position):
        return f"{file.relative_to(root)}:{text.count(chr(10), 0, position) + 1}"

    named = [(m.start(1), m.group(1)) for m in re.finditer(r"plumbline::([a-z]+)", text)]
    for listed in re.finditer(r"\bDEPENDS\s+([a-z_\s]+)", text):
        named += [(listed.start(1) + m.start(), m.group()) for m in re.finditer(r"\w+", listed.group(1))]
    for position, other in named:
        if other not in LAYER_OF or other == module:
            continue
        depends.add(other)
        if LAYER_OF[other] >= LAYER_OF[module]:
            problems.append(f"{where(position)}: {module} depends on {other}, which is not in a lower layer")
    for library, homes, _, target in CONFINED:
        found = re.search(rf"(?<![\w:/])(?:{target})", text)
        if module not in homes and found:
            problems.append(f"{where(found.start())}: {module} links {library}, which belongs to "
                            f"{' and '.join(homes)} only")
    return depends, problems


def closure(depends):
    """Everything a module sees through its dependencies."""
    def walk(module, seen):
        for other in depends[module]:
            if other not in seen:
                seen.add(other)
                walk(other, seen)
        return seen
    return {module: walk(module, set()) for module in depends}


def check_code(root, module, reachable):
    problems = []
    for file in code_of(root, module):
        for number, line in enumerate(file.read_text(errors="replace").splitlines(), 1):
            where = f"{file.relative_to(root)}:{number}"
            include = INCLUDE.match(line)
            if include:
                wrong = check_include(module, include.group(1), include.group(2), reachable)
                if wrong:
                    problems.append(f"{where}: {wrong}")
                continue
            text = without_comment(line)
            if module not in PROGRAM:
                problems += [f"{where}: {why}" for what, why in FORBIDDEN if what.search(text)]
            problems += [f"{where}: {why}" for home, what, why in ALONE
                         if what.search(text) and file != root / home]
    return problems


def check_subfolders(root, module):
    """Subfolders of a module include each other one way only."""
    home, sees, at = root / folder_of(module), {}, {}
    for file in code_of(root, module):
        folder = file.parent.name if file.parent.parent == home else ""
        for number, line in enumerate(file.read_text(errors="replace").splitlines(), 1):
            include = INCLUDE.match(line)
            other = Path(include.group(2)).parts[0] if include and include.group(1) == '"' else ""
            if folder and other != folder and (home / other).is_dir() and other:
                sees.setdefault(folder, set()).add(other)
                at[folder, other] = f"{file.relative_to(root)}:{number}"
    blind = [f"{at[a, b]}: {a} includes {b}, which it must not know" for a, b in BLIND.get(module, []) if (a, b) in at]
    seen = closure({name: sees.get(name, set()) for name in set(sees) | {o for s in sees.values() for o in s}})
    return blind + [f"{where}: {a} includes {b}, which includes {a}" for (a, b), where in at.items() if a in seen[b]]


def check_folders(root):
    """A module without a layer would escape every other check."""
    problems = []
    for parent in (root / "src", root / "include" / "plumbline"):
        for folder in sorted(parent.glob("*")):
            if folder.is_dir() and folder.name not in LAYER_OF:
                problems.append(f"{folder.relative_to(root)}:1: this module is in no layer")
    return problems


def source_files(root):
    """Files of the tree without those of builds, which other tests make and remove meanwhile."""
    for folder, folders, names in os.walk(root):
        folders[:] = [name for name in folders if name not in SKIPPED]
        yield from (Path(folder) / name for name in names)


def check_spdx(root):
    problems = []
    for file in sorted(source_files(root)):
        relative = file.relative_to(root)
        if CORPORA in relative.parents:
            continue
        script = relative.parts[0] in ("scripts", ".ci")
        if file.suffix not in SPDX_SUFFIXES and file.name != "CMakeLists.txt" and not script:
            continue
        if not any(SPDX in line for line in file.read_text(errors="replace").splitlines()[:2]):
            problems.append(f"{relative}:1: no '{SPDX}' in the first two lines")
    return problems


def check(root):
    """(problems, number of source files looked at)"""
    problems = check_folders(root) + check_spdx(root)
    depends = {}
    for module in LAYER_OF:
        depends[module], wrong = read_cmake(root, module)
        problems += wrong
    reachable = closure(depends)
    for module in LAYER_OF:
        problems += check_code(root, module, reachable[module]) + check_subfolders(root, module)
    return problems, sum(len(code_of(root, module)) for module in LAYER_OF)


def main(root):
    problems, files = check(root)
    print("\n".join(problems + [f"{files} source files, {len(problems)} problems"]))
    return 1 if problems or files == 0 else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
