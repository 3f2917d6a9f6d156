// SPDX-License-Identifier: BSD-3-Clause
// judge_las.mjs FILE.las FILE.ply: reads the LAS with npm's copc and compares it with the same cloud as PLY.
import { createRequire } from 'module'
import fs from 'fs'
const require = createRequire(process.env.JUDGES + '/')
const { Las } = require('copc')

const [lasFile, plyFile] = process.argv.slice(2)
const fail = (text) => { console.error(text); process.exit(1) }

// The PLY: its header tells the columns.
const ply = fs.readFileSync(plyFile)
const end = ply.indexOf('end_header\n') + 'end_header\n'.length
const sizes = { double: 8, float: 4, uchar: 1, int: 4 }
let count = 0, stride = 0
const columns = {}
for (const line of ply.subarray(0, end).toString('latin1').split('\n')) {
  const words = line.split(' ')
  if (words[0] === 'element') count = Number(words[2])
  if (words[0] !== 'property') continue
  columns[words[2]] = [words[1], stride]
  stride += sizes[words[1]]
}
const plyValue = (i, name) => {
  const [type, at] = columns[name]
  const offset = end + i * stride + at
  return type === 'double' ? ply.readDoubleLE(offset) : type === 'float' ? ply.readFloatLE(offset)
    : type === 'int' ? ply.readInt32LE(offset) : ply[offset]
}

const file = fs.readFileSync(lasFile)
const getter = async (a, b) => file.subarray(a, b)
const header = Las.Header.parse(file.subarray(0, 375))
if (header.majorVersion !== 1 || header.minorVersion !== 4) fail('not LAS 1.4')
if (header.pointDataRecordFormat !== 7) fail('not point format 7')
if (header.pointCount !== count) fail(`${header.pointCount} points, the PLY has ${count}`)
if (!(header.globalEncoding & 16)) fail('the WKT bit is not set')
if (file.readUInt32LE(107) !== 0) fail('the legacy count is not 0')
const vlrs = await Las.Vlr.walk(getter, header)
const wkt = Las.Vlr.find(vlrs, 'LASF_Projection', 2112)
if (!wkt) fail('no WKT')
const wktText = (await Las.Vlr.fetch(getter, wkt)).toString()
if (!wktText.includes('UTM zone 33N')) fail('WKT: ' + wktText)
const extraVlr = Las.Vlr.find(vlrs, 'LASF_Spec', 4)
const extra = extraVlr ? Las.ExtraBytes.parse(await Las.Vlr.fetch(getter, extraVlr)) : []
const names = extra.map((e) => e.name)
for (const name of ['confidence', 'sigma']) if (!names.includes(name)) fail(`no extra bytes ${name}: ${names}`)

const points = file.subarray(header.pointDataOffset, header.pointDataOffset + header.pointCount * header.pointDataRecordLength)
const view = Las.View.create(points, header, extra)
const get = Object.fromEntries(
  ['X', 'Y', 'Z', 'Red', 'Green', 'Blue', 'confidence', 'sigma', 'ReturnNumber', 'NumberOfReturns'].map((n) => [n, view.getter(n)]))
const low = [1e99, 1e99, 1e99], high = [-1e99, -1e99, -1e99]
let worst = 0
for (let i = 0; i < count; ++i) {
  ;['X', 'Y', 'Z'].forEach((n, k) => {
    const value = get[n](i)
    worst = Math.max(worst, Math.abs(value - plyValue(i, 'xyz'[k])))
    low[k] = Math.min(low[k], value)
    high[k] = Math.max(high[k], value)
  })
  ;['Red', 'Green', 'Blue'].forEach((n) => {
    if (get[n](i) !== 257 * plyValue(i, n.toLowerCase())) fail(`colour of point ${i}`)
  })
  for (const n of ['confidence', 'sigma']) if (Math.abs(get[n](i) - plyValue(i, n)) > 1e-6) fail(`${n} of point ${i}`)
  if (get.ReturnNumber(i) !== 1 || get.NumberOfReturns(i) !== 1) fail('returns')
}
if (worst > 0.0006) fail(`a point is ${worst} m from where the PLY has it`)
for (let k = 0; k < 3; ++k) {
  if (Math.abs(header.min[k] - low[k]) > 1e-4 || Math.abs(header.max[k] - high[k]) > 1e-4) fail('bounds')
}
console.log(`${count} points, ${names}; at most ${(1e3 * worst).toFixed(3)} mm from the PLY; ${low.map((v) => v.toFixed(1))}`)
