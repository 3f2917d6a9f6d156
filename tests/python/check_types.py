#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The module's types: mypy --strict over it and the examples, stubtest of the compiled part; check_types.py ROOT MODULE

MODULE is the folder that holds the built package. Exit code 77 without mypy.
"""
import importlib.util
import os
import subprocess
import sys
from pathlib import Path


def main(root, module):
    if importlib.util.find_spec("mypy") is None:
        print("mypy is not installed (scripts/install-deps --judges)")
        return 77
    env = dict(os.environ, PYTHONPATH=str(module), MYPYPATH=str(root / "src" / "python"))
    cache = ["--cache-dir", str(module / "mypy_cache")]
    checks = [
        [sys.executable, "-m", "mypy", "--strict", *cache, "-p", "plumbline"],
        [sys.executable, "-m", "mypy", "--strict", *cache, "--allow-untyped-calls", str(root / "examples" / "python")],
        [sys.executable, "-m", "mypy.stubtest", "plumbline._core", "--ignore-missing-stub", "--allowlist",
         str(Path(__file__).with_name("stubtest_allowed.txt"))],
    ]
    codes = [subprocess.run(check, cwd=module, env=env, check=False).returncode for check in checks]
    return 1 if any(codes) else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()))
