// Drafts a FreeSewing design to a file of measurements and writes what a cutter needs to know of it as JSON.
//
//   npm ci --legacy-peer-deps
//   node draft.mjs DESIGN MEASUREMENTS.yaml OUT.json [option=value ...]
//
// The JSON, read by toile-import: lengths in mm, y down the page. Every part has its named points, its paths as segments
// (move, line, cubic, close), notches, buttons and grain line; the cut list says how often a part is cut from which
// material and on which line it is folded.
import { readFileSync, writeFileSync } from 'node:fs'
import { parse } from 'yaml'

const [design, measurementsFile, outFile, ...optionTexts] = process.argv.slice(2)
if (!outFile) {
  console.error('usage: node draft.mjs DESIGN MEASUREMENTS.yaml OUT.json [option=value ...]')
  process.exit(2)
}

const millimetres = { mm: 1, cm: 10, m: 1000, inch: 25.4, deg: 1 }
const measurements = {}
for (const [name, text] of Object.entries(parse(readFileSync(measurementsFile, 'utf8')))) {
  const [, number, unit] = /^\s*([-+.0-9e]+)\s*([a-z]+)\s*$/.exec(text) ?? []
  if (!(unit in millimetres)) throw new Error(`${measurementsFile}: ${name}: '${text}' is no length or angle`)
  // FreeSewing knows no body height; it takes angles in degrees and lengths in mm.
  if (name !== 'stature') measurements[name] = Number(number) * millimetres[unit]
}
const options = Object.fromEntries(
  optionTexts.map((text) => {
    const [name, value] = text.split('=')
    return [name, value === 'true' ? true : value === 'false' ? false : Number.isNaN(Number(value)) ? value : Number(value)]
  })
)

const module = await import(`@freesewing/${design}`)
const Design = module[design[0].toUpperCase() + design.slice(1)]
// expand: also parts that are otherwise only described in words. No seam allowance: seams are drawn on the seam line.
const pattern = new Design({ measurements, options, sa: 0, complete: true, paperless: false, expand: true })
pattern.draft()
const store = pattern.setStores[0]
const errors = (store.logs?.error ?? []).map(String)
if (errors.length > 0) throw new Error(`${design}: ${errors.join('; ')}`)

// Six decimals of a millimetre are beyond any cutter and drop the noise of the last bits.
const round = (value) => Math.round(value * 1e6) / 1e6 + 0
const at = (point) => [round(point.x), round(point.y)]

function segments(path) {
  return path.ops
    .filter((op) => ['move', 'line', 'curve', 'close'].includes(op.type))
    .map((op) => {
      if (op.type === 'curve') return { type: 'cubic', cp1: at(op.cp1), cp2: at(op.cp2), to: at(op.to) }
      return op.to ? { type: op.type, to: at(op.to) } : { type: op.type }
    })
}

const parts = {}
const cutlist = {}
for (const [name, part] of Object.entries(pattern.parts[0])) {
  if (part.hidden) continue
  const drawn = { points: {}, paths: {}, notches: [], buttons: [], grainline: null }
  for (const [id, point] of Object.entries(part.points)) {
    if (!id.startsWith('__')) drawn.points[id] = at(point)
  }
  for (const [id, path] of Object.entries(part.paths)) {
    if (/^__macro_grainline/.test(id)) drawn.grainline = [at(path.ops[0].to), at(path.ops.at(-1).to)]
    if (id.startsWith('__')) continue
    drawn.paths[id] = { class: path.attributes.get('class') || '', hidden: Boolean(path.hidden), segments: segments(path) }
  }
  for (const snippet of Object.values(part.snippets)) {
    if (/notch$/.test(snippet.def)) drawn.notches.push({ def: snippet.def, at: at(snippet.anchor) })
    if (/^button|^snap/.test(snippet.def)) drawn.buttons.push({ def: snippet.def, at: at(snippet.anchor) })
  }
  parts[name] = drawn
  const cut = store.cutlist?.[name] ?? store.get('cutlist')?.[name]
  if (!cut) continue
  cutlist[name] = { materials: cut.materials ?? {}, grainOrigin: cut.grainOrigin ?? null }
  if (Array.isArray(cut.cutOnFold)) cutlist[name].cutOnFold = cut.cutOnFold.map((point) => ({ x: round(point.x), y: round(point.y) }))
}

const version = pattern.designConfig?.data?.version ?? module.about?.version ?? null
const result = { design, version, units: 'mm', y: 'down', measurements, options, parts, cutlist }

// One line for each thing without further structure: short files that can still be read and compared.
function format(value, indent) {
  const flat = JSON.stringify(value)
  const simple = (v) => v === null || typeof v !== 'object' || (Array.isArray(v) && v.every((e) => typeof e !== 'object'))
  if (simple(value) || (Object.values(value).every(simple) && flat.length < 140)) return flat
  const inner = indent + ' '
  const rows = Array.isArray(value)
    ? value.map((v) => inner + format(v, inner))
    : Object.entries(value).map(([k, v]) => `${inner}${JSON.stringify(k)}: ${format(v, inner)}`)
  const [open, close] = Array.isArray(value) ? '[]' : '{}'
  return `${open}\n${rows.join(',\n')}\n${indent}${close}`
}
writeFileSync(outFile, format(result, '') + '\n')
console.log(`${outFile}: ${Object.keys(parts).length} parts of ${design} ${version}`)
