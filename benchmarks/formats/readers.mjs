// What JavaScript packages make of files: `node readers.mjs READER FOLDER FILE...` prints JSON; FOLDER has node_modules.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { extname, join } from "node:path";
import { pathToFileURL } from "node:url";

const [, , reader, folder, ...paths] = process.argv;
const require = createRequire(pathToFileURL(join(folder, "package.json")));
const load = (name) => import(pathToFileURL(join(folder, "node_modules", name)));
const bytesOf = (path) => {
  const data = readFileSync(path);
  return data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength);
};

async function three() {
  globalThis.self ??= globalThis;
  const { JSDOM } = require("jsdom");
  globalThis.DOMParser = new JSDOM("").window.DOMParser;
  const THREE = await load("three/build/three.module.js");
  const at = "three/examples/jsm/loaders";
  const [{ OBJLoader }, { GLTFLoader }, { STLLoader }, { ThreeMFLoader }, { SVGLoader }] = await Promise.all(
    ["OBJ", "GLTF", "STL", "3MF", "SVG"].map((name) => load(`${at}/${name}Loader.js`)),
  );
  const open = {
    ".obj": (path) => new OBJLoader().parse(readFileSync(path, "utf8")),
    ".stl": (path) => new THREE.Mesh(new STLLoader().parse(bytesOf(path))),
    ".3mf": (path) => new ThreeMFLoader().parse(bytesOf(path)),
    ".glb": async (path) => (await new GLTFLoader().parseAsync(bytesOf(path), "")).scene,
  };
  const measure = async (path) => {
    if (extname(path) === ".svg") {
      let area = 0;
      for (const drawn of new SVGLoader().parse(readFileSync(path, "utf8")).paths) {
        if (drawn.userData.style.fill === "none" || drawn.userData.node.nodeName !== "path") continue;
        for (const shape of SVGLoader.createShapes(drawn)) area += Math.abs(THREE.ShapeUtils.area(shape.getPoints()));
      }
      return { area };
    }
    const scene = await open[extname(path)](path);
    scene.updateMatrixWorld(true);
    let area = 0, volume = 0;
    scene.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const position = mesh.geometry.getAttribute("position"), index = mesh.geometry.getIndex();
      const n = index ? index.count : position.count;
      const corner = (k) => {
        const at = new THREE.Vector3().fromBufferAttribute(position, index ? index.getX(k) : k);
        return at.applyMatrix4(mesh.matrixWorld);
      };
      for (let k = 0; k < n; k += 3) {
        const [a, b, c] = [corner(k), corner(k + 1), corner(k + 2)];
        area += new THREE.Triangle(a, b, c).getArea();
        volume += a.dot(b.cross(c)) / 6;
      }
    });
    const box = new THREE.Box3().setFromObject(scene);
    return { area, volume, box: [box.min.toArray(), box.max.toArray()] };
  };
  return { version: THREE.REVISION, measure };
}

async function babylon() {
  globalThis.self ??= globalThis;
  const BABYLON = require("@babylonjs/core");
  require("@babylonjs/loaders");
  const { Vector3, VertexBuffer } = BABYLON;
  const measure = async (path) => {
    const scene = new BABYLON.Scene(new BABYLON.NullEngine());
    const ending = extname(path);
    const text = ending === ".obj" ? readFileSync(path, "utf8") : ";base64," + readFileSync(path).toString("base64");
    const pluginOptions = { gltf: { animationStartMode: 0 } }; // at rest
    await BABYLON.AppendSceneAsync("data:" + text, scene, { pluginExtension: ending, pluginOptions });
    let area = 0, volume = 0, low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (const mesh of scene.meshes) {
      const flat = mesh.getVerticesData(VertexBuffer.PositionKind);
      if (!flat) continue;
      const world = mesh.computeWorldMatrix(true), index = mesh.getIndices();
      const corner = (k) => Vector3.TransformCoordinates(Vector3.FromArray(flat, 3 * index[k]), world);
      for (let k = 0; k < index.length; k += 3) {
        const [a, b, c] = [corner(k), corner(k + 1), corner(k + 2)];
        area += Vector3.Cross(b.subtract(a), c.subtract(a)).length() / 2;
        volume += Vector3.Dot(a, Vector3.Cross(b, c)) / 6;
        for (const p of [a, b, c]) [p.x, p.y, p.z].forEach((x, i) => {
          low[i] = Math.min(low[i], x);
          high[i] = Math.max(high[i], x);
        });
      }
    }
    const [x0, x1] = ending === ".glb" ? [-high[0], -low[0]] : [low[0], high[0]]; // its space is left-handed
    return { area, volume: Math.abs(volume), box: [[x0, ...low.slice(1)], [x1, ...high.slice(1)]] };
  };
  return { version: require("@babylonjs/core/package.json").version, measure };
}

async function validator() {
  const checker = require("gltf-validator");
  const measure = async (path) => {
    const { issues } = await checker.validateBytes(new Uint8Array(bytesOf(path)));
    return { messages: issues.messages.map((message) => message.code) };
  };
  return { version: checker.version(), measure };
}

const { version, measure } = await { three, babylon, validator }[reader]();
const found = [];
for (const path of paths) {
  try {
    found.push(await measure(path));
  } catch (error) {
    found.push({ error: String(error).slice(0, 200) });
  }
}
console.log("\n" + JSON.stringify({ version: String(version), found }));
process.exit(0);
