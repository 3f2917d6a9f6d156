# SPDX-License-Identifier: BSD-3-Clause
"""A wheel from the same CMake as all else: pip wheel --no-build-isolation --no-deps src/python

PLUMBLINE_BUILD names a build folder that is there already; without it one is made (build/wheel), which takes as long as
building the program. The wheel needs the shared libraries of the system that it was built on.
"""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.build_py import build_py

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
VERSION = re.search(r"project\(plumbline VERSION ([0-9.]+)", (ROOT / "CMakeLists.txt").read_text()).group(1)


class WithParts(Distribution):
    """Has compiled parts, though setuptools compiles none."""

    def has_ext_modules(self):
        return True


class Build(build_py):
    """CMake builds and installs the module with its parts and pipelines; that is the package."""

    def run(self):
        build = Path(os.environ.get("PLUMBLINE_BUILD") or ROOT / "build" / "wheel")
        if not (build / "build.ninja").exists():
            self.cmake("-S", ROOT, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DPLUMBLINE_TESTS=OFF",
                       "-DCMAKE_UNITY_BUILD=ON", f"-DPLUMBLINE_PYTHON={sys.executable}")
        self.cmake("--build", build, "--target", "plumbline_python")
        package = Path(self.build_lib).resolve() / "plumbline"
        shutil.rmtree(package, ignore_errors=True)
        self.cmake("--install", build, "--component", "wheel", "--prefix", package.parent)

    @staticmethod
    def cmake(*words):
        subprocess.run(["cmake", *map(str, words)], check=True)


setup(
    name="plumbline",
    version=VERSION,
    description="RGB-D recordings in, one dense metric point cloud out",
    license="BSD-3-Clause",
    python_requires=">=3.9",
    install_requires=["numpy"],
    packages=["plumbline"],
    cmdclass={"build_py": Build},
    distclass=WithParts,
)
