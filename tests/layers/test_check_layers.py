#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The layer check, tried on made-up trees: a clean one passes, every kind of offence is found."""
import contextlib
import io
import tempfile
import unittest
from pathlib import Path

import check_layers

SPDX_CPP = "// SPDX-License-Identifier: BSD-3-Clause\n"
SPDX_CMAKE = "# SPDX-License-Identifier: BSD-3-Clause\n"


class CheckLayers(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = Path(folder.name)
        below = ""
        for layer in check_layers.LAYERS:
            for module in layer:
                depends = f" DEPENDS {below}" if below else ""
                self.write(check_layers.folder_of(module) / "CMakeLists.txt",
                           f"{SPDX_CMAKE}plumbline_module({module}{depends})\n")
                self.write(f"include/plumbline/{module}/{module}.hpp", SPDX_CPP)
                self.write(check_layers.folder_of(module) / "a.cpp", SPDX_CPP)
            below = " ".join(layer)

    def write(self, path, text):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def problems(self):
        problems, files = check_layers.check(self.root)
        self.assertGreater(files, 0)
        return problems

    def assert_found(self, expected, code, path):
        """`code` in a file of the clean tree gives exactly one problem, at its line."""
        self.write(path, SPDX_CPP + code + "\n")
        problems = self.problems()
        self.assertEqual(len(problems), 1, problems)
        self.assertTrue(problems[0].startswith(f"{path}:2: "), problems)
        self.assertIn(expected, problems[0])

    def test_clean_tree_passes(self):
        self.write("src/mapping/a.cpp", SPDX_CPP + '#include "plumbline/core/core.hpp"\n#include "b.hpp"\n'
                   '#include <vector>\n// printf("x"); getenv("y");\nconst char* s = "exit(1)";\n')
        self.assertEqual(self.problems(), [])

    def test_exit_code(self):
        with contextlib.redirect_stdout(io.StringIO()):
            self.assertEqual(check_layers.main(self.root), 0)
            self.assertEqual(check_layers.main(self.root / "nothing"), 1)
            self.write("src/core/a.cpp", "no licence\n")
            self.assertEqual(check_layers.main(self.root), 1)

    def test_json_of_others_is_read_in_one_file(self):
        for call in ("auto v = Json::parse(stream);", "nlohmann::json::accept(text);", "stream >> json;"):
            self.assert_found("core::read_json", call, "src/cli/a.cpp")
        self.assert_found("core::json_text", "print(json.dump(2));", "src/cli/a.cpp")
        self.write("src/cli/a.cpp", SPDX_CPP)
        self.write("src/core/json.cpp", SPDX_CPP + "Json::parse(text);\njson.dump(2);\n")
        self.assertEqual(self.problems(), [])

    def test_include_of_a_higher_layer(self):
        self.assert_found("a higher layer", '#include "plumbline/mapping/mapping.hpp"', "src/core/a.cpp")

    def test_include_in_a_public_header(self):
        self.assert_found("a higher layer", '#include "plumbline/viz/viz.hpp"',
                          "include/plumbline/maps/maps.hpp")

    def test_include_of_the_same_layer(self):
        self.assert_found("its own layer", '#include "plumbline/synth/synth.hpp"', "src/evaluate/a.cpp")

    def test_angle_brackets_count_as_well(self):
        self.assert_found("a higher layer", "# include <plumbline/cli/cli.hpp>", "maps/a.cpp")

    def test_include_without_dependency(self):
        self.write("src/geometry/CMakeLists.txt", SPDX_CMAKE + "plumbline_module(geometry)\n")
        self.assert_found("does not depend on core", '#include "plumbline/core/core.hpp"', "src/geometry/a.cpp")

    def test_include_of_an_unknown_module(self):
        self.assert_found("in no layer", '#include "plumbline/extras/x.hpp"', "src/cli/a.cpp")

    def test_include_out_of_the_folder(self):
        self.assert_found("own folder", '#include "../core/secret.hpp"', "src/geometry/a.cpp")

    def test_subfolders_that_include_each_other(self):
        self.write("src/mapping/one/a.hpp", SPDX_CPP)
        self.write("src/mapping/two/b.hpp", SPDX_CPP + '#include "one/a.hpp"\n')
        self.assertEqual(self.problems(), [])
        self.write("src/mapping/one/a.hpp", SPDX_CPP + '#include "two/b.hpp"\n')
        self.assertEqual(len(self.problems()), 2)

    def test_runner_that_knows_a_stage(self):
        self.write("src/pipeline/stages/a.hpp", SPDX_CPP)
        self.write("src/pipeline/run/b.cpp", SPDX_CPP + '#include "stages/a.hpp"\n')
        self.assertEqual(self.problems(), ["src/pipeline/run/b.cpp:2: run includes stages, which it must not know"])

    def test_confined_libraries(self):
        self.assert_found("VTK belongs to viz", "#include <vtkActor.h>", "src/pipeline/a.cpp")
        self.setUp()
        self.assert_found("Ceres belongs to optimize", "#include <ceres/ceres.h>", "src/mapping/a.cpp")
        self.setUp()
        self.assert_found("yaml-cpp belongs to core", "#include <yaml-cpp/yaml.h>", "src/synth/a.cpp")

    def test_confined_libraries_at_home(self):
        self.write("viz/a.cpp", SPDX_CPP + "#include <vtkActor.h>\n")
        self.write("src/optimize/a.cpp", SPDX_CPP + "#include <ceres/ceres.h>\n")
        self.write("src/core/a.cpp", SPDX_CPP + "#include <yaml-cpp/yaml.h>\n")
        self.assertEqual(self.problems(), [])

    def test_cmake_dependency_upwards(self):
        self.write("src/sensor/CMakeLists.txt",
                   SPDX_CMAKE + "plumbline_module(sensor DEPENDS geometry\n  tracking LINK x)\n")
        problems = self.problems()
        self.assertEqual(len(problems), 1, problems)
        self.assertIn("src/sensor/CMakeLists.txt:3: sensor depends on tracking", problems[0])

    def test_cmake_dependency_sideways(self):
        self.write("src/cloud/CMakeLists.txt", SPDX_CMAKE + "plumbline_module(cloud DEPENDS sensor)\n"
                   "target_link_libraries(plumbline_cloud PRIVATE plumbline::features)\n")
        self.assertIn("cloud depends on features", "".join(self.problems()))

    def test_cmake_link_of_a_confined_library(self):
        self.write("src/tracking/CMakeLists.txt",
                   SPDX_CMAKE + "plumbline_module(tracking DEPENDS maps PRIVATE_LINK Ceres::ceres)\n")
        self.assertIn("tracking links Ceres", "".join(self.problems()))

    def test_module_without_cmake(self):
        (self.root / "src/net/CMakeLists.txt").unlink()
        self.assertIn("src/net/CMakeLists.txt:1: is missing", self.problems())

    def test_module_without_layer(self):
        self.write("src/extras/a.cpp", SPDX_CPP)
        self.assertIn("src/extras:1: this module is in no layer", self.problems())

    def test_libraries_leave_the_process_alone(self):
        for code, why in [('std::cout << "x";', "print"), ('printf("x");', "print"), ("std::exit(1);", "end"),
                          ("abort();", "end"), ('std::getenv("HOME");', "environment"),
                          ("int r = std::rand();", "seed"), ("std::random_device d;", "seed")]:
            with self.subTest(code):
                self.assert_found(why, code, "src/cloud/a.cpp")

    def test_the_program_may_print(self):
        self.write("src/cli/a.cpp", SPDX_CPP + 'void f() { fmt::print("x"); }\n')
        self.assertEqual(self.problems(), [])

    def test_formatting_is_no_printing(self):
        self.write("src/core/a.cpp", SPDX_CPP + "void f() { snprintf(b, 3, s); }\n")
        self.assertEqual(self.problems(), [])

    def test_spdx(self):
        for path in ["src/core/b.cpp", "scripts/run", "pipelines/x.yaml", "tests/unit/test_core_x.cpp"]:
            self.write(path, "nothing\n")
            self.assertEqual([p.split(":")[0] for p in self.problems()], [path])
            (self.root / path).unlink()
        self.write("build/release/x.cpp", "made by a tool\n")
        self.write("tests/fuzz/corpus/yaml/x.yaml", "{\n")
        self.assertEqual(self.problems(), [])
        self.write("tests/fuzz/x.yaml", "nothing\n")
        self.assertEqual([p.split(":")[0] for p in self.problems()], ["tests/fuzz/x.yaml"])


if __name__ == "__main__":
    unittest.main()
