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
missing = {"walls", "dimensions", "grid", "path"} - layers
if missing or plain.dxfversion != "AC1015":
    sys.exit(f"{plain.dxfversion}, layers {sorted(layers)}")
askew = [e.dxf.rotation for e in space.query("TEXT") if not -88.0 < (e.dxf.rotation + 180.0) % 360.0 - 180.0 <= 92.001]
if askew:
    sys.exit(f"texts stand on their heads: {askew}")
walls = [(e.dxf.start, e.dxf.end) for e in space.query('LINE[layer=="walls"]')]
lengths = sorted(math.dist(a, b) for a, b in walls)
texts = [e.dxf.text for e in space.query('TEXT[layer=="dimensions"]') if "m" not in e.dxf.text]
whole = [t for t in texts if any(abs(float(t) - length) < 0.0051 for length in lengths)]
print(f"{len(walls)} pieces of walls, {len(texts)} dimensions, {len(whole)} of walls without openings; 0 errors, 0 fixes")
