#!/usr/bin/env bash
# three.js 0.187.0: `Box3.setFromObject` counts morph targets in that have no influence.
#
# Input: a unit square at the origin with one morph target, which would move it by 10 in x; its influence is 0.
# Guess: the box of what is drawn, from 0 to 1: the influence is there to be asked. Cameras are framed by this box.
# Seen: from 0 to 20, which is beyond where even full influence would take the square (11): the box that has been made
# wider once is made wider again. `setFromObject(mesh, true)`, "precise", which goes through all vertices, has 0 to 1.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund three@0.187.0 >/dev/null
cat > look.mjs <<'JAVASCRIPT'
import { Box3, BufferGeometry, Float32BufferAttribute, Mesh } from "three";

const geometry = new BufferGeometry();
geometry.setAttribute("position", new Float32BufferAttribute([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0], 3));
geometry.morphAttributes.position = [new Float32BufferAttribute([10, 0, 0, 10, 0, 0, 10, 0, 0, 10, 0, 0], 3)];
geometry.morphTargetsRelative = true;
geometry.setIndex([0, 1, 2, 0, 2, 3]);
const mesh = new Mesh(geometry);
const seen = [false, true].map((precise) => new Box3().setFromObject(mesh, precise).max.x);
console.log(`influence ${mesh.morphTargetInfluences[0]}: box to x = ${seen[0]}, precise: ${seen[1]}`);
process.exit(seen[0] === 20 && seen[1] === 1 ? 0 : 1);
JAVASCRIPT
node look.mjs
