#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Makes a wheel of the build that is there, installs it in a folder of its own and maps with it: run_wheel.py ROOT BUILD WORK

Exit code 77 without pip, setuptools or wheel.
"""
import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path

SCRIPT = """
import plumbline
result = plumbline.map("synth:room?frames=12&width=160&height=120", "out")
assert len(result.trajectory) == 12 and len(result.cloud) > 100
assert plumbline.render(result, size=(96, 64)).shape == (64, 96, 3)  # a part, found beside the module
print(plumbline.__file__)
"""


def main(root, build, work):
    missing = [name for name in ("pip", "setuptools", "wheel") if importlib.util.find_spec(name) is None]
    if missing:
        print(f"{', '.join(missing)} not installed for {sys.executable} (scripts/install-deps --judges)")
        return 77
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    env = dict(os.environ, PLUMBLINE_BUILD=str(build))
    env.pop("PYTHONPATH", None)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--no-cache-dir"]
    subprocess.run([*pip, "wheel", "--no-build-isolation", "--no-deps", "-w", str(work), str(root / "src" / "python")],
                   check=True, env=env)
    wheels = list(work.glob("plumbline-*.whl"))
    assert len(wheels) == 1, wheels
    subprocess.run([*pip, "install", "--no-deps", "--no-index", "--target", str(work / "site"), str(wheels[0])],
                   check=True, env=env)
    env["PYTHONPATH"] = str(work / "site")
    # Nothing of the build folder may be of use to it.
    said = subprocess.run([sys.executable, "-c", SCRIPT], cwd=work, env=env, check=True, stdout=subprocess.PIPE, text=True)
    assert said.stdout.strip().startswith(str(work / "site")), said.stdout
    return 0


if __name__ == "__main__":
    sys.exit(main(*(Path(argument).resolve() for argument in sys.argv[1:4])))
