// SPDX-License-Identifier: BSD-3-Clause
// judge_glb.mjs FILE.glb: Khronos' validator; neither errors nor warnings.
import { createRequire } from 'module'
import fs from 'fs'
const require = createRequire(process.env.JUDGES + '/')
const validator = require('gltf-validator')

const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2])))
const { numErrors, numWarnings, messages } = report.issues
console.log(`${report.info.totalVertexCount} vertices, ${report.info.totalTriangleCount} triangles, ${numErrors} errors, ${numWarnings} warnings`)
if (numErrors + numWarnings > 0) {
  console.error(JSON.stringify(messages.slice(0, 10), null, 1))
  process.exit(1)
}
