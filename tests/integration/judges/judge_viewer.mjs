// SPDX-License-Identifier: BSD-3-Clause
// judge_viewer.mjs CASE PAGE.html WORK [NUMBERS]: Debian's Chromium, or Firefox in the case firefox, opens the page from disk, without a display, and
// uses it as a person does; what each control does is read from the page. Prints what it saw; exit code 1: something
// was wrong.
import { createRequire } from 'module'
import fs from 'fs'
import path from 'path'
import { pathToFileURL } from 'url'
const require = createRequire(process.env.JUDGES + '/')
const puppeteer = require('puppeteer-core')

const [what, file, work, ...numbers] = process.argv.slice(2)
const wrong = []
const check = (good, text) => { if (!good) wrong.push(text) }
const sleep = (ms) => new Promise((done) => setTimeout(done, ms))

async function launch(more = []) {
  return puppeteer.launch({ executablePath: '/usr/bin/chromium', headless: true, args: ['--no-sandbox', '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader', '--disable-background-networking', '--disable-component-update', '--disable-sync', '--no-first-run', ...more] })
}

/** With a window, on xvfb: without one Firefox has no WebGL. */
async function launchFirefox() {
  return puppeteer.launch({ browser: 'firefox', executablePath: '/usr/bin/firefox-esr', headless: false, extraPrefsFirefox: { 'webgl.force-enabled': true } })
}

/** A page that complains of whatever it asks for elsewhere, and of every error. */
async function open(browser, size, hash = '', before = null) {
  const page = await browser.newPage()
  await page.setViewport(size)
  page.on('console', (m) => check(m.type() !== 'error', `console: ${m.text()}`))
  page.on('pageerror', (e) => check(false, `error in the page: ${e.message}`))
  page.on('request', (r) => check(r.isNavigationRequest() || /^(data|blob):/.test(r.url()), `asks for ${r.url()}`))
  if (before) await page.evaluateOnNewDocument(before)
  await page.goto(pathToFileURL(file).href + hash, { timeout: 120000 })
  return page
}

const inPage = (page, f, ...a) => page.evaluate(`(${f})(document.querySelector('.pv').viewer, ...${JSON.stringify(a)})`)
/** Waits until a condition of the page holds; after 20 s that is wrong. */
async function until(page, name, f, ...a) {
  const holds = `(${f})(document.querySelector('.pv').viewer, ...${JSON.stringify(a)})`
  await page.waitForFunction(holds, { timeout: 20000, polling: 50 }).catch(() => check(false, `${name}: not within 20 s`))
}
/** Until nothing is left to be drawn. */
async function rest(page) {
  await page.waitForFunction(() => {
    const { view } = document.querySelector('.pv').viewer
    return view.loaded && view.complete && !view.refining && !view.dirty && !view.fence
  }, { timeout: 180000, polling: 50 })
}
const drawn = (page) => page.$eval('.pv-canvas', (c) => Number(c.dataset.pointsDrawn))
/** A number that changes when the picture does. */
async function look(page) {
  await rest(page)
  return page.evaluate(async () => {
    const { viewer } = document.querySelector('.pv')
    const bytes = new Uint8Array(await (await viewer.picture()).arrayBuffer())
    return bytes.reduce((h, b) => (h * 31 + b) | 0, 7)
  })
}
async function changes(page, name, act) {
  const before = await look(page)
  await act()
  check(await look(page) !== before, `${name}: the picture stays as it was`)
}

async function controls(page, downloads) {
  const state = () => inPage(page, (v) => v.state())
  const camera = async () => (await state()).c
  const box = await (await page.$('.pv-canvas')).boundingBox()
  const at = (x, y) => [box.x + x * box.width, box.y + y * box.height]

  // Mouse.
  let before = await camera()
  await changes(page, 'drag', async () => {
    await page.mouse.move(...at(0.5, 0.5))
    await page.mouse.down()
    await page.mouse.move(...at(0.6, 0.55), { steps: 5 })
    await page.mouse.up()
  })
  let after = await camera()
  check(Math.abs(after[4] - before[4]) > 0.05 && Math.abs(after[5] - before[5]) > 0.02, 'drag does not turn')
  await changes(page, 'drag with the right button', async () => {
    await page.mouse.move(...at(0.5, 0.5))
    await page.mouse.down({ button: 'right' })
    await page.mouse.move(...at(0.55, 0.6), { steps: 5 })
    await page.mouse.up({ button: 'right' })
  })
  before = after
  after = await camera()
  check(before[4] === after[4] && Math.hypot(...[1, 2, 3].map((k) => after[k] - before[k])) > 0.05, 'the right button does not move')
  before = after
  const anchor = await inPage(page, (v, x, y) => v.view.anchor(x, y), 0.6 * box.width, 0.5 * box.height)
  const was = await inPage(page, (v, p) => v.view.project(p), anchor)
  await changes(page, 'wheel', async () => {
    await page.mouse.move(...at(0.6, 0.5))
    await page.mouse.wheel({ deltaY: -240 })
    await sleep(100)
  })
  const now = await inPage(page, (v, p) => v.view.project(p), anchor)
  check((await camera())[6] < 0.8 * before[6], 'the wheel does not bring nearer')
  check(Math.hypot(now[0] - was[0], now[1] - was[1]) < 3, `the zoom does not go to the pointer: ${was} becomes ${now}`)

  // Fingers.
  const session = await page.createCDPSession()
  const touch = async (steps) => {
    for (let i = 0; i < steps.length; ++i) {
      await session.send('Input.dispatchTouchEvent', { type: i ? 'touchMove' : 'touchStart',
        touchPoints: steps[i].map(([x, y], id) => ({ x: at(x, y)[0], y: at(x, y)[1], id })) })
      await sleep(30)
    }
    await session.send('Input.dispatchTouchEvent', { type: 'touchEnd', touchPoints: [] })
  }
  before = await camera()
  await touch([[[0.5, 0.5]], [[0.55, 0.5]], [[0.6, 0.5]]])
  after = await camera()
  check(Math.abs(after[4] - before[4]) > 0.05, 'one finger does not turn')
  before = after
  await touch([[[0.45, 0.5], [0.55, 0.5]], [[0.4, 0.5], [0.6, 0.5]], [[0.35, 0.5], [0.65, 0.5]]])
  after = await camera()
  check(after[6] < 0.7 * before[6], 'two fingers do not bring nearer')
  before = after
  await touch([[[0.4, 0.5], [0.5, 0.5], [0.6, 0.5]], [[0.4, 0.55], [0.5, 0.55], [0.6, 0.55]], [[0.4, 0.6], [0.5, 0.6], [0.6, 0.6]]])
  after = await camera()
  check(Math.hypot(after[1] - before[1], after[2] - before[2]) > 0.02 && Math.abs(after[3] - before[3]) < 1e-6, 'three fingers do not walk')

  // Keys.
  await page.focus('.pv-canvas')
  for (const [key, mode] of [['2', 'walk'], ['3', 'top'], ['1', 'orbit']]) {
    await changes(page, `key ${key}`, () => page.keyboard.press(key))
    check((await camera())[0] === mode, `key ${key} does not lead to ${mode}`)
    check(await drawn(page) > 1000, `${mode}: nearly nothing is drawn`)
    await page.screenshot({ path: path.join(work, `${mode}.png`) })
  }
  await page.keyboard.press('2')
  before = await camera()
  check(await inPage(page, (v) => Math.abs(v.view.camera.eye[2] - v.view.floor - 1.6)) < 0.01, 'walking is not at 1.6 m')
  for (const [key, axis] of [['w', 'ahead'], ['d', 'right']]) {
    const from = await inPage(page, (v) => [v.view.camera.eye, v.view.camera.ahead, v.view.camera.right])
    const way = from[axis === 'ahead' ? 1 : 2]
    await page.keyboard.down(key)
    await until(page, `key ${key} walks`, (v, eye, way) => v.view.camera.eye.reduce((s, c, k) => s + (c - eye[k]) * way[k], 0) > 0.2, from[0], way)
    await page.keyboard.up(key)
  }
  await page.keyboard.press('?')
  check(await page.$eval('.pv-help', (d) => d.open), '? shows no help')
  await page.keyboard.press('Escape')
  await page.focus('.pv-canvas')
  await page.keyboard.press('Home')
  await page.keyboard.press('1')
  check(await page.evaluate(() => [...document.querySelectorAll('.pv button, .pv select, .pv input')].every((e) => e.tabIndex >= 0)),
    'a control is not reached by the keyboard')

  // Layers and what is shown.
  for (const value of await page.$$eval('.pv-bar select[aria-label="Colour by"] option', (all) => all.map((o) => o.value))) {
    if (value === 'photo') continue
    await changes(page, `colour ${value}`, async () => {
      await page.select('.pv-bar select[aria-label="Colour by"]', value)
      await page.waitForFunction((key) => document.querySelector('.pv-legend em') && document.querySelector('.pv').viewer.layers.value === key, { timeout: 60000 }, value)
      await sleep(100)
    })
    await page.screenshot({ path: path.join(work, `layer_${value}.png`) })
    check(await page.$eval('.pv-legend', (e) => e.children.length) > 2, `colour ${value}: no legend`)
  }
  await page.select('.pv-bar select[aria-label="Colour by"]', 'photo')
  await sleep(200)
  await page.evaluate(() => { document.querySelector('.pv-more').open = true })
  for (const label of await page.$$('.pv-box label')) {
    const box1 = await label.$('input[type=checkbox]')
    if (!box1) continue
    const name = await label.evaluate((e) => e.textContent)
    await changes(page, name, () => box1.evaluate((e) => e.click()))
    await box1.evaluate((e) => e.click())
  }
  await page.evaluate(() => { document.querySelector('.pv-more').open = false })

  // Time.
  await changes(page, 'time', () => page.$eval('.pv-time input', (e) => { e.value = 500; e.dispatchEvent(new Event('input')) }))
  check(await page.$eval('.pv-thumb', (e) => e.offsetWidth > 100 && e.naturalWidth === 160), 'no picture of the keyframe')
  check(await inPage(page, (v) => v.scene.keyframes.every((k) => !k.i || k.i.length < 5000 * 4 / 3 + 4)), 'a small picture is larger than 5 kB')
  await page.screenshot({ path: path.join(work, 'fly.png') })
  await page.keyboard.press('p')
  await until(page, 'it flies', () => Number(document.querySelector('.pv-time input').value) > 500)
  await page.keyboard.press('p')

  // Cut.
  await page.keyboard.press('Home')
  await page.keyboard.press('1')
  await changes(page, 'slab', () => page.select('.pv-bar select[aria-label="Cut"]', 'slab'))
  await changes(page, 'slab, lower', () => page.$eval('[data-cut=high2]', (e) => { e.value = 1; e.dispatchEvent(new Event('input')) }))
  check(await inPage(page, (v) => Math.abs(v.view.cut.high[2] - 1) < 0.011), 'the slab does not follow its slider')
  await changes(page, 'box', () => page.select('.pv-bar select[aria-label="Cut"]', 'box'))
  const handle = await inPage(page, (v) => [0, 1, 2, 3, 4, 5].map((i) => v.view.cut && v.handles()[i]).find((h) => h && h.at && h.axis === 2 && h.side === 'high'))
  before = await inPage(page, (v) => v.view.cut.high[2])
  await page.mouse.move(box.x + handle.at[0], box.y + handle.at[1])
  await page.mouse.down()
  await page.mouse.move(box.x + handle.at[0], box.y + handle.at[1] + 40, { steps: 4 })
  await page.mouse.up()
  check(await inPage(page, (v) => v.view.cut.high[2]) < before - 0.05, 'the handle does not drag the face')

  // Saving.
  const saved = async (name, act) => {
    await act()
    const to = path.join(downloads, name)
    for (let i = 0; i < 200 && !fs.existsSync(to); ++i) await sleep(50)
    check(fs.existsSync(to), `${name} was not saved`)
    return fs.existsSync(to) ? fs.readFileSync(to) : Buffer.alloc(0)
  }
  const name = await inPage(page, (v) => v.scene.name)
  const ply = await saved(`${name}.ply`, () => inPage(page, (v) => v.savePoints()))
  const cut = await inPage(page, (v) => ({ ...v.view.cut, base: v.view.base }))
  const head = ply.indexOf('end_header\n') + 11, count = Number(/element vertex (\d+)/.exec(ply.toString('latin1', 0, head))[1])
  check(ply.length === head + 15 * count && count > 500, `PLY: ${count} points in ${ply.length} bytes`)
  for (let i = 0; i < count; ++i) {
    const p = [0, 1, 2].map((k) => ply.readFloatLE(head + 15 * i + 4 * k))
    if (!p.every((v, k) => v >= cut.low[k] + cut.base[k] - 1e-3 && v <= cut.high[k] + cut.base[k] + 1e-3)) { check(false, `PLY: ${p} is cut away`); break }
  }
  const png = await saved(`${name}.png`, () => inPage(page, (v) => v.savePicture()))
  check(png.length > 20000 && png.readUInt32BE(16) === box.width, 'PNG: not the picture')
  return { ply: count }
}

async function measuring(page) {
  await page.evaluate(() => { document.querySelector('.pv-bar select[aria-label="Cut"]').value = 'none' })
  await inPage(page, (v) => { v.cutBy('none'); v.look('orbit'); v.view.home() })
  await rest(page)
  const box = await (await page.$('.pv-canvas')).boundingBox()
  const pick = (tool) => page.select('.pv-bar select[aria-label="Measure"]', tool)
  const last = () => inPage(page, (v) => { const m = v.measuring.list; return m.length ? { text: m[m.length - 1].text, value: m[m.length - 1].value, error: m[m.length - 1].error, points: m[m.length - 1].points } : null })
  const spots = await inPage(page, (v, w, h) => {
    const found = []
    for (let y = 0.35; y < 0.8; y += 0.07) for (let x = 0.3; x < 0.75; x += 0.07) { const p = v.view.pick(x * w, y * h); if (p) found.push([x * w, y * h]) }
    return found
  }, box.width, box.height)
  check(spots.length > 6, 'no points to measure')
  const points = () => inPage(page, (v) => v.measuring.list.reduce((sum, m) => sum + m.points.length, 0))
  const click = async (i) => {
    const before = await points()
    await page.mouse.click(box.x + spots[i][0], box.y + spots[i][1])
    await until(page, `click ${i} is taken`, (v, n) => v.measuring.list.reduce((sum, m) => sum + m.points.length, 0) > n, before)
  }
  await pick('distance')
  await click(0)
  await click(spots.length - 1)
  const d = await last()
  check(/^distance \d+\.\d{3} m ± .*mm \(level .*, height .*\)$/.test(d.text), `distance: ${d.text}`)
  check(Math.abs(d.value - Math.hypot(...[0, 1, 2].map((k) => d.points[0].p[k] - d.points[1].p[k]))) < 1e-9, 'distance: another value')
  const finest = await inPage(page, (v, p) => Math.min(...v.view.around(p, 0.02).map((q) => Math.hypot(...q.map((c, k) => c - p[k])))), d.points[0].p)
  check(finest < 1e-9, 'a measured point is none of the cloud')
  await pick('height')
  await click(2)
  const h = await last()
  check(/^height -?\d+\.\d{3} m ± .* above the floor$/.test(h.text), `height: ${h.text}`)
  await pick('line')
  for (const i of [0, 2, 4]) await click(i)
  await page.focus('.pv-canvas')
  await page.keyboard.press('Enter')
  check(/^length .* over 3 points$/.test((await last()).text), `line: ${(await last()).text}`)
  await pick('area')
  for (const i of [0, 3, spots.length - 1]) await click(i)
  await page.focus('.pv-canvas')
  await page.keyboard.press('Enter')
  check(/^area \d+\.\d{3} m²/.test((await last()).text) && (await last()).value > 0, `area: ${(await last()).text}`)
  await pick('plane')
  await click(1)
  check(/^plane/.test((await last()).text), `plane: ${(await last()).text}`)
  const told = await inPage(page, (v) => v.measuring.text())
  const flags = told.split('\n').filter((line) => /^  --length "[-\d.]+(,[-\d.]+){2}" "[-\d.]+(,[-\d.]+){2}" \d+\.\d{4}m$/.test(line))
  check(told.split('\n').length - flags.length === 5, `five measurements as text: ${told}`)
  check(flags.length === 1, `the distance as adjust takes it: ${told}`)
  console.log(told)
  await page.screenshot({ path: path.join(work, 'measured.png') })

  const link = await inPage(page, (v) => v.link())
  const again = await open(page.browser(), page.viewport(), link.slice(link.indexOf('#')))
  await rest(again)
  const [a, b] = [await inPage(page, (v) => v.state()), await inPage(again, (v) => v.state())]
  check(JSON.stringify(a) === JSON.stringify(b), `the link restores ${JSON.stringify(b)} of ${JSON.stringify(a)}`)
  await again.close()
}

const kLeastBudget = 20000 // points of a picture, of view.js
/** Turns the view over 40 pictures; returns the median of their rate, and what is drawn in the last one. */
async function speed(page) {
  const box = await (await page.$('.pv-canvas')).boundingBox()
  await page.evaluate(() => {
    window.pictures = []
    new MutationObserver(() => window.pictures.push(performance.now())).observe(document.querySelector('.pv-canvas'),
      { attributes: true, attributeFilter: ['data-frames'] })
  })
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2)
  await page.mouse.down()
  for (let i = 0; await page.evaluate(() => window.pictures.length) < 40; ++i) {
    await page.mouse.move(box.x + box.width / 2 + 100 * Math.sin(i / 15), box.y + box.height / 2)
    await sleep(15)
  }
  const fewest = await drawn(page), budget = await inPage(page, (v) => v.view.budget)
  await page.mouse.up()
  const at = await page.evaluate(() => window.pictures), apart = at.slice(1).map((t, i) => t - at[i]).sort((a, b) => a - b)
  return { fps: 1000 / apart[apart.length >> 1], fewest, least: budget <= 2 * kLeastBudget }
}

const cases = {
  /** Everything that a person may do. */
  async whole() {
    const browser = await launch(), downloads = path.join(work, 'saved')
    fs.rmSync(downloads, { recursive: true, force: true })
    fs.mkdirSync(downloads, { recursive: true })
    const client = await browser.target().createCDPSession()
    await client.send('Browser.setDownloadBehavior', { behavior: 'allow', downloadPath: downloads })
    const page = await open(browser, { width: 1300, height: 1000 })
    await rest(page)
    const first = await page.$eval('.pv-canvas', (c) => Number(c.dataset.firstMs)), all = await inPage(page, (v) => v.view.loaded)
    console.log(`first picture after ${first} ms, ${await drawn(page)} points after ${Math.round(all)} ms`)
    await page.screenshot({ path: path.join(work, 'first.png') })
    const { ply } = await controls(page, downloads)
    await measuring(page)
    const { fps, fewest } = await speed(page)
    console.log(`${ply} points saved as PLY; ${fps.toFixed(1)} frames a second while it turns, ${fewest} points each`)
    await browser.close()
  },

  /** Times and memory of a large page; NUMBERS: points in it. */
  async large() {
    const browser = await launch()
    // By the page's own clock: messages between browser and script are no part of it.
    const page = await open(browser, { width: 1300, height: 1000 }, '', () => {
      new MutationObserver(() => {
        const canvas = document.querySelector('.pv-canvas')
        if (canvas && Number(canvas.dataset.pointsDrawn) >= 100000) window.soon = window.soon || performance.now()
      }).observe(document, { subtree: true, attributes: true, attributeFilter: ['data-points-drawn'] })
    })
    await page.waitForFunction(() => window.soon, { timeout: 60000 })
    const soon = await page.evaluate(() => window.soon)
    await rest(page)
    const points = await inPage(page, (v) => v.view.clouds[0].ready)
    const whole = await page.evaluate(() => performance.now())
    const { fps, fewest, least } = await speed(page)
    let resident = 0
    for (const entry of fs.readdirSync('/proc')) {
      if (!/^\d+$/.test(entry)) continue
      try {
        if (!fs.readFileSync(`/proc/${entry}/cmdline`, 'latin1').includes('--type=renderer')) continue
        if (!fs.readFileSync(`/proc/${entry}/cmdline`, 'latin1').includes(browser.process().spawnargs.find((a) => a.startsWith('--user-data-dir=')) || '\0')) continue
        resident = Math.max(resident, Number(/VmRSS:\s+(\d+)/.exec(fs.readFileSync(`/proc/${entry}/status`, 'latin1'))[1]) / 1024)
      } catch { /* it has ended */ }
    }
    console.log(`${points} points: 100 000 drawn after ${Math.round(soon)} ms, all that are seen after ${Math.round(whole)} ms; ` +
      `${fps.toFixed(1)} frames a second while it turns, ${fewest} points each; the page's process takes ${Math.round(resident)} MB`)
    check(points === Number(numbers[0]), `${points} of ${numbers[0]} points were read`)
    // How fast it is depends on the machine, and what it does then does not: it draws as little as it may.
    check(fps >= 4 || least, 'it turns slowly, and draws more than it must')
    check(resident < 600, 'too much memory')
    await page.screenshot({ path: path.join(work, 'large.png') })
    await browser.close()
  },

  /** NUMBERS: places of two points, six, and their distance. */
  async width() {
    const browser = await launch(), page = await open(browser, { width: 1300, height: 1000 }), n = numbers.map(Number)
    await rest(page)
    const got = await inPage(page, async (v, a, b) => {
      const middle = a.map((x, k) => (x + b[k]) / 2)
      Object.assign(v.view.camera, { mode: 'orbit', yaw: Math.PI / 2, pitch: 0, target: middle, distance: 1.5 })
      v.view.cull = false
      v.view.resize(1)
      v.measuring.choose('distance')
      for (const p of [a, b]) {
        const [x, y] = v.view.project(p)
        await v.click(x, y)
      }
      v.view.changed()
      return v.measuring.list[0]
    }, n.slice(0, 3), n.slice(3, 6))
    await rest(page)
    await page.screenshot({ path: path.join(work, 'width.png') })
    console.log(got.text)
    check(Math.abs(got.value - n[6]) < 0.01, `${got.value} m instead of ${n[6]} m`)
    await browser.close()
  },

  /** The main things in Firefox: it draws, turns, walks, measures and restores a view. */
  async firefox() {
    const browser = await launchFirefox(), page = await open(browser, { width: 1300, height: 1000 })
    await rest(page)
    console.log(`first picture after ${await page.$eval('.pv-canvas', (c) => c.dataset.firstMs)} ms, ${await drawn(page)} points`)
    check(await drawn(page) > 1000, 'nearly nothing is drawn')
    await page.screenshot({ path: path.join(work, 'firefox.png') })

    const box = await (await page.$('.pv-canvas')).boundingBox()
    const middle = [box.x + box.width / 2, box.y + box.height / 2]
    await changes(page, 'drag', async () => {
      await page.mouse.move(...middle)
      await page.mouse.down()
      await page.mouse.move(middle[0] + 80, middle[1] + 30, { steps: 5 })
      await page.mouse.up()
    })
    await page.focus('.pv-canvas')
    for (const [key, mode] of [['2', 'walk'], ['3', 'top'], ['1', 'orbit']]) {
      await changes(page, `key ${key}`, () => page.keyboard.press(key))
      check((await inPage(page, (v) => v.state())).c[0] === mode, `key ${key} does not lead to ${mode}`)
    }
    await changes(page, 'colour by height', () => page.select('.pv-bar select[aria-label="Colour by"]', 'height'))
    await measuring(page)
    await browser.close()
  },

  /** A report on a screen and on paper: nothing is wider than the window, and WORK/report.pdf shows the map. */
  async print() {
    const browser = await launch()
    for (const width of [1300, 420]) {
      const page = await open(browser, { width, height: 900 })
      const wide = await page.evaluate(() => document.documentElement.scrollWidth)
      check(wide <= width, `the page is ${wide} pixels wide in a window of ${width}`)
      for (const w of await page.$$eval('.plans img', (all) => all.map((e) => e.getBoundingClientRect().width)))
        check(w > 0.5 * width * Math.min(1, 1040 / width) && w < width, `a plan is ${w} pixels wide in a window of ${width}`)
      await page.close()
    }
    const page = await open(browser, { width: 1300, height: 1000 })
    await rest(page)
    await page.pdf({ path: path.join(work, 'report.pdf'), format: 'A4', preferCSSPageSize: true, printBackground: true })
    const paper = await page.$eval('.pv-paper', (c) => {
      const { data } = c.getContext('2d').getImageData(0, 0, c.width, c.height)
      const colors = new Set()
      for (let i = 0; i < data.length; i += 4000) colors.add(`${data[i]},${data[i + 1]},${data[i + 2]}`)
      return colors.size
    })
    check(paper > 20, `the map on paper has ${paper} colours`)
    await browser.close()
  },

  /** Two results over one another: each shows itself, both are tinted, and the distances are those of their points. */
  async two() {
    const browser = await launch(), page = await open(browser, { width: 1300, height: 1000 })
    await page.focus('.pv-canvas')
    await rest(page)
    const visible = () => inPage(page, (v) => v.view.clouds.map((c) => c.visible).join())
    check(await visible() === 'true,false', `at first ${await visible()} is shown`)
    await page.screenshot({ path: path.join(work, 'a.png') })
    for (const [shown, name] of [['false,true', 'b'], ['true,true', 'both'], ['true,false', 'again']]) {
      await changes(page, `X, ${name}`, () => page.keyboard.press('x'))
      check(await visible() === shown, `X leads to ${await visible()} instead of ${shown}`)
      await page.screenshot({ path: path.join(work, `${name}.png`) })
    }
    await changes(page, 'colour by distance', async () => {
      await page.select('.pv-bar select[aria-label="Colour by"]', 'distance')
      await page.waitForFunction(() => /Distance/.test(document.querySelector('.pv-legend').textContent), { timeout: 60000 })
      await sleep(100)
    })
    await page.screenshot({ path: path.join(work, 'distance.png') })

    // A step of the layer is 25 %; the page's grid moves each of two points by 1.7 mm at most. Beside points from all over
    // the cloud those that are told to be far from the other map, where these do not count.
    const pairs = await inPage(page, async (v) => {
      const [a, b] = v.view.clouds, at = a.layer('distance'), layer = a.layers[at], out = []
      for (const chunk of a.chunks) {
        const steps = await a.values(chunk, at), told = (i) => layer.low * (layer.high / layer.low) ** ((steps[i] - 1) / layer.steps)
        const all = Array.from({ length: chunk.count }, (_, i) => i), far = all.filter((i) => told(i) > 0.03 && told(i) < 0.15)
        for (const i of [all, far].flatMap((list) => list.filter((_, k) => k % Math.ceil(list.length / 6) === 0))) {
          const p = a.place(chunk, i)
          let least = Infinity
          for (const other of b.chunks) {
            for (let k = 0; k < other.count; ++k) {
              const q = b.place(other, k)
              least = Math.min(least, Math.hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]))
            }
          }
          out.push([told(i), least])
        }
      }
      return out
    })
    const off = pairs.filter(([told, real]) => Math.abs(told - Math.min(Math.max(real, 0.001), 0.2)) > 0.13 * real + 0.0035)
    const far = pairs.filter(([, real]) => real > 0.025).length
    console.log(`${pairs.length} distances looked up, ${far} of more than 25 mm, ${off.length} told wrongly`)
    check(pairs.length > 20 && far > 4 && off.length === 0, `distances told and real: ${JSON.stringify(off.slice(0, 3))}`)
    await browser.close()
  },

  /** Without WebGL 2, and with a damaged link. */
  async without() {
    const browser = await launch()
    const page = await open(browser, { width: 900, height: 700 }, '', () => {
      HTMLCanvasElement.prototype.getContext = () => null
    })
    check(/no WebGL 2/.test(await page.$eval('.pv-still', (e) => e.hidden ? '' : e.textContent)), 'it does not tell that there is no WebGL')
    const damaged = await open(browser, { width: 900, height: 700 }, '#view=%7Bdamaged')
    await rest(damaged)
    check(/damaged/.test(await damaged.$eval('.pv-told', (e) => e.textContent)), 'a damaged link is not told')
    check(await drawn(damaged) > 1000, 'with a damaged link nothing is drawn')
    await browser.close()
  },

  /** Pictures to be looked at: NUMBERS are width, height, "dark" or "light", a view link's JSON or "". */
  async shots() {
    const browser = await launch(), [width, height, theme, state, name] = numbers
    const page = await browser.newPage()
    await page.setViewport({ width: Number(width), height: Number(height) })
    await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: theme }])
    await page.goto(pathToFileURL(file).href + (state ? `#view=${encodeURIComponent(state)}` : ''), { timeout: 120000 })
    await rest(page)
    await page.screenshot({ path: path.join(work, name) })
    await browser.close()
  },
}

await cases[what]()
for (const text of wrong) console.error(`wrong: ${text}`)
process.exit(wrong.length ? 1 : 0)
