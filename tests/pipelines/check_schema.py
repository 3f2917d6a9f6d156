#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Judges the generated JSON Schemas: check_schema.py PROGRAM ROOT

They are valid schemas themselves, accept every shipped pipeline and filter chain and each pipeline with all its
defaults written out, and refuse every file of broken/schema. The program refuses some of those and of broken/graph
with exit code 2 and says nothing on standard output.
"""
import json
import subprocess
import sys
from pathlib import Path

import jsonschema
import yaml


def run(program, *arguments):
    return subprocess.run([program, *arguments], capture_output=True, text=True)


def schema(program, *words):
    made = run(program, *words)
    if made.returncode != 0:
        sys.exit(f"plumbline {' '.join(words)}: exit code {made.returncode}\n{made.stderr}")
    tree = json.loads(made.stdout)
    jsonschema.Draft7Validator.check_schema(tree)
    return jsonschema.Draft7Validator(tree)


def load(file):
    return yaml.safe_load(file.read_text())


def is_chain(file):
    return file.name.startswith("chain_") or "filters" in file.parts


def main(program, root):
    pipelines = schema(program, "pipelines", "schema")
    chains = schema(program, "filters", "schema")
    problems = []

    def expect(ok, file, what):
        if not ok:
            problems.append(f"{file.relative_to(root) if file.is_absolute() else file}: {what}")

    shipped = sorted(root.glob("pipelines/*.yaml")) + sorted(root.glob("pipelines/filters/**/*.yaml"))
    for file in shipped:
        judge = chains if is_chain(file) else pipelines
        for error in judge.iter_errors(load(file)):
            problems.append(f"{file.relative_to(root)}: refused: {error.json_path}: {error.message}")
    for file in sorted(root.glob("pipelines/*.yaml")):
        written = run(program, "pipelines", "check", "-v", str(file)).stdout.partition("\n")[2]
        for error in pipelines.iter_errors(yaml.safe_load(written)):
            problems.append(f"{file.relative_to(root)} written out: refused: {error.json_path}: {error.message}")

    stages = pipelines.schema["definitions"]["stage"]["properties"]["type"]["enum"]
    for stage in stages:
        schema(program, "pipelines", "schema", stage)

    broken = root / "tests" / "pipelines" / "broken"
    by_schema = sorted((broken / "schema").glob("*.yaml"))
    for file in by_schema:
        judge = chains if is_chain(file) else pipelines
        expect(not judge.is_valid(load(file)), file, "accepted by the schema")
    by_program = sorted((broken / "graph").glob("*.yaml"))
    for file in (by_schema + by_program)[::8]:  # unit tests load them all; here it is the exit code
        group = "filters" if is_chain(file) else "pipelines"
        checked = run(program, group, "check", str(file))
        expect(checked.returncode == 2, file, f"exit code {checked.returncode}")
        expect(checked.stdout == "", file, "something on standard output")

    print("\n".join(problems + [f"{len(shipped)} shipped files, {len(by_schema)} broken by the schema, "
                                f"{len(by_program)} beyond it, {len(stages)} stages; {len(problems)} problems"]))
    enough = len(shipped) >= 8 and len(by_schema) >= 40 and len(by_program) >= 20
    return 1 if problems or not enough else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2]).resolve()))
