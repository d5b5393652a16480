#!/usr/bin/env bash
# three.js 0.187.0: ThreeMFLoader takes a 3MF file in inches for one in millimetres.
#
# Input: the same tetrahedron, one unit high, in two packages: unit="millimeter" and unit="inch".
# Guess: one comes out 25.4 times as large as the other, or the object says which unit it has: the format has units so
# that nobody needs to ask.
# Seen: both are one unit high, and neither group nor mesh has the unit in `userData`.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund three@0.187.0 fflate@0.8.2 jsdom@29.1.1 >/dev/null
cat > look.mjs <<'JAVASCRIPT'
import { strToU8, zipSync } from "fflate";
import { JSDOM } from "jsdom";

globalThis.DOMParser = new JSDOM("").window.DOMParser;
const { Box3 } = await import("three");
const { ThreeMFLoader } = await import("three/examples/jsm/loaders/3MFLoader.js");

const places = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]].map(([x, y, z]) => `<vertex x="${x}" y="${y}" z="${z}"/>`);
const faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]].map(([a, b, c]) => `<triangle v1="${a}" v2="${b}" v3="${c}"/>`);
const open = "http://schemas.openxmlformats.org/package/2006";
const core = "http://schemas.microsoft.com/3dmanufacturing";
const packed = (unit) => zipSync({
  "[Content_Types].xml": strToU8(`<Types xmlns="${open}/content-types"><Default Extension="rels"
    ContentType="application/vnd.openxmlformats-package.relationships+xml"/><Default Extension="model"
    ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>`),
  "_rels/.rels": strToU8(`<Relationships xmlns="${open}/relationships"><Relationship Id="model"
    Target="/3D/3dmodel.model" Type="${core}/2013/01/3dmodel"/></Relationships>`),
  "3D/3dmodel.model": strToU8(`<model unit="${unit}" xmlns="${core}/core/2015/02"><resources>
    <object id="1" type="model"><mesh><vertices>${places.join("")}</vertices><triangles>${faces.join("")}</triangles>
    </mesh></object></resources><build><item objectid="1"/></build></model>`),
});
const seen = ["millimeter", "inch"].map((unit) => {
  const group = new ThreeMFLoader().parse(packed(unit).buffer);
  group.updateMatrixWorld(true);
  const told = [];
  group.traverse((thing) => told.push(JSON.stringify(thing.userData)));
  return { unit, height: new Box3().setFromObject(group).max.z, tells: told.some((text) => text.includes(unit)) };
});
seen.forEach(({ unit, height, tells }) => console.log(`${unit}: ${height} high, the unit told: ${tells}`));
process.exit(seen.every(({ height, tells }) => height === 1 && !tells) ? 0 : 1);
JAVASCRIPT
node look.mjs
