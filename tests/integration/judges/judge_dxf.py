# SPDX-License-Identifier: BSD-3-Clause
"""judge_dxf.py FILE.dxf: ezdxf's audit, without errors and without anything mended; walls as long as they say,
texts that are read from below or from the right."""
import math
import sys

import ezdxf
from ezdxf import recover

plain = ezdxf.readfile(sys.argv[1])
document, auditor = recover.readfile(sys.argv[1])
second = plain.audit()
problems = [str(e.message) for a in (auditor, second) for e in a.errors + a.fixes]
if problems:
    sys.exit("\n".join(problems[:20]))
space = plain.modelspace()
layers = {entity.dxf.layer for entity in space}
hatched = "one-sided" not in sys.argv  # a wall of which one face was seen has no solid
missing = ({"A-WALL", "A-ANNO-DIMS", "A-ANNO"} | ({"A-WALL-PATT"} if hatched else set())) - layers
if missing or plain.dxfversion != "AC1015":
    sys.exit(f"{plain.dxfversion}, layers {sorted(layers)}")
askew = [e.dxf.rotation for e in space.query("TEXT") if not -88.0 < (e.dxf.rotation + 180.0) % 360.0 - 180.0 <= 92.001]
if askew:
    sys.exit(f"texts stand on their heads: {askew}")
dimensions = space.query("DIMENSION")
grid_scale = 0.0005 if "grid" in sys.argv else 0.0  # UTM's, of places; texts tell true lengths
for d in dimensions:
    block = plain.blocks.get(d.dxf.geometry)
    if block is None or not d.dxf.geometry.startswith("*D") or d.dxf.dimstyle not in plain.dimstyles or len(block) < 3:
        sys.exit(f"a dimension without its block or style: {d.dxf.geometry}, {d.dxf.dimstyle}")
    said, measured = float(d.dxf.text.replace(",", ".")), d.dxf.actual_measurement
    if abs(said - measured) > 0.001 or abs(d.get_measurement() - measured) > 0.001 + grid_scale * measured:
        sys.exit(f"a dimension says {said}, group 42 {measured}, its places {d.get_measurement()}")
hatches = space.query("HATCH")
if not all(path.is_closed for hatch in hatches for path in hatch.paths):
    sys.exit("a hatch is open")
if not dimensions or (hatched and not hatches):
    sys.exit(f"{len(dimensions)} dimensions, {len(hatches)} hatches")
print(f"{len(dimensions)} dimensions, {len(hatches)} hatches, {len(space.query('INSERT'))} symbols; 0 errors, 0 fixes")
