// SPDX-License-Identifier: BSD-3-Clause
// docs/guide/exports.md, made from the table of formats.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "formats.hpp"
#include "plumbline/core/option_schema.hpp"

namespace plumbline::exports {
namespace {

constexpr const char* kExportsIntroduction = R"(# Exports

<!-- Made by `plumbline export --describe`; change the table in src/exports. -->

`plumbline export MAP -o FILE` writes a map in the format of another program. `MAP` is a result folder, the
`map.db` of a run (of an interrupted one, too), a fused map of several robots, or, where a cloud is enough, any
PLY or PCD file. A folder below `components/` holds a map that did not join the rest of its run; it can be exported to the formats
that need no `map.db`.

The format follows from the ending of the output, or from `--format`.

```sh
plumbline export out/room -o grid.yaml                       # for Nav2, with grid.pgm
plumbline export out/room -o colmap                          # a COLMAP model with pictures
plumbline export out/room -o room.las --voxel "2 cm"         # for surveyors' programs
plumbline export out/room -o room.glb --mesh                 # for a browser
plumbline export out/room -o path.csv --what trajectory      # the path in EuRoC's format
plumbline export out/room -o open.ply --z 0,2m               # without the ceiling: up to 2 m over the floor
```

)";

constexpr const char* kExportsFrame = R"(
![Grid of a generated office](pictures/grid.png)

*The grid of a generated office that two robots filmed in part: black is occupied, white is free, grey was not seen.*

![Plan of a generated home](pictures/plan.png)

*A plan on its sheet ([plans.md](plans.md)).*

For a map of 1.5 million points (a generated office, 181 keyframes, 826 views) on two cores:

| export | seconds | size |
|---|---|---|
| `.ply` | 0.6 | 58 MB |
| `.las` | 0.9 | 66 MB |
| `.glb` | 0.7 | 29 MB |
| `.yaml` with `.pgm` | 2.5 | 50 kB |
| `.svg`, `.pdf`, `.dxf` | 1.7 to 2.4 | 12 to 36 kB |
| `.bt`, `.ot` | 10 | 0.2 MB, 4.1 MB |
| mesh as `.obj`, `.glb` | 54, 63 | 124 MB, 42 MB |
| COLMAP, nerfstudio (181 pictures) | 7, 9 | 71 MB, 86 MB |

Except for meshes, none took more than 0.25 GB of memory for a kitchen of 1.16 million points (27 keyframes, 174 views).

## At the end of a run

The stage `output` takes a list, so that `map`, `fuse` and the hub write exports into the result folder, and the report
shows plans and links the rest:

```yaml
  output:
    type: output
    inputs: {map: refine, cloud: fuse}
    exports:
      - grid.yaml
      - plan.svg
      - {file: model, format: colmap, sharpest: on}
```

An export that cannot be made, such as a plan without walls, only causes a warning.

## One frame

All exports of one map are in one frame, that of its results: metres, right-handed, z up, 0 on the floor, x along the
walls ([dense_cloud.md](dense_cloud.md)). Grid, cloud, LAS, octree, COLMAP model and path coincide; only GLB is turned to
glTF's axes, and `--datum` and `--epsg` move their outputs. Each file that can hold text names its frame, PLY and PCD
[as a comment](../reference/files.md#frames-of-clouds) that is read again. For an interrupted run the floor is searched during the export.

`--datum LAT,LON,HEADING` gives the position of the map's origin on WGS 84 and the direction of its x axis (degrees
clockwise from true north); the map is moved into the UTM zone there, turned by the zone's convergence and scaled by its
local scale. `--epsg N --origin E,N,H` moves it into any projected system in metres; a fourth number turns the map clockwise,
in degrees. The transform is in the file's own header and, as a whole matrix, in `FILE.georeference.json`.

Files are written under another name first and renamed when they are whole: a full disk leaves nothing that looks
finished. A folder is replaced (`--force`) only if an earlier export made it.

)";

/// `--voxel, --ascii`
std::string flags_text(const std::vector<std::string>& keys) {
  std::vector<std::string> flags;
  for (std::string key : keys) {
    std::replace(key.begin(), key.end(), '_', '-');
    flags.push_back("`--" + key + "`");
  }
  return fmt::format("{}", fmt::join(flags, ", "));
}

std::string endings_text(const FormatInfo& format) {
  return format.endings == "folder" ? format.endings : "`" + format.endings + "`";
}

std::string options_text() {
  ExportOptions options;
  core::OptionTable table;
  options.declare(table);
  return core::options_as_markdown(table.specs());
}

}  // namespace

/// The page about exports, from the table of formats.
std::string exports_page() {
  std::string page = kExportsIntroduction;
  page += "| format | output | what it is | also needs |\n|---|---|---|---|\n";
  const std::vector<FormatInfo> infos = export_formats();
  for (const FormatInfo& format : infos) {
    page += fmt::format("| [{0}](#{0}) | {1} | {2} | {3} |\n", format.name, endings_text(format),
                        format.title, format.needs);
  }

  // Choice of formats, then all options
  page +=
      "\nFormats with the same ending are selected by `--what trajectory|keyframes|lines` and `--mesh`. "
      "There is no E57, because no library in Debian writes it; CloudCompare converts PLY and LAS to E57.\n";
  page += kExportsFrame;
  page += fmt::format(
      "## Options\n\n{} work with every format, the others with those that list them below. In "
      "`exports:` of the stage `output` they are written as here, on the command line as `--dense-points "
      "1000` or `--ascii on`: switches take `on` or `off`.\n\n{}",
      flags_text(common_options()), options_text());

  // A section for each format
  for (const FormatInfo& format : infos) {
    page += fmt::format("\n## {}\n\n{}: {}.{}\n\n{}\n", format.name, format.title, endings_text(format),
                        format.options.empty() ? "" : " Takes " + flags_text(format.options) + ".",
                        format.description);
  }

  return page;
}

}  // namespace plumbline::exports
