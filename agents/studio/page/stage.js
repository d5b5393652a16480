// The stage: picture, mask, mesh, and the tools that work on them with a pointer or with keys.
import { Painting, SIDE } from "./painting.js";

const { SCALE, byId, set, clamp, make, edgesOf, elementsOf, place } = Drawing;
const MARGIN = 0.06, NUDGE = 1 / 256, FAR = 8; // of the box; a key's move in the unit square, with Shift so many times
const TOLD = {
  look: "Point at an element for its name; click through the steps in the player.",
  paint: "Paint where matching matters: the search minds it as soon as the brush is lifted.",
  lock: "Click vertices that are to stay where they are when the search goes on from here.",
  pull: "Drag a vertex to where you want it. It is locked there. With keys: Enter, arrows, Enter.",
  axis: "Drag the line about which left and right are to be alike; the search begins anew with it.",
  split: "Click two corners of a face: an edge joins them.",
  delete: "Click a face that is too much.",
  add: "Click an edge: it gets a vertex in its middle.",
  dissolve: "Click a vertex, or an inner edge, that is too much.",
  extrude: "Click an edge on the rim: a new face grows out of it.",
};

export class Stage {
  /** `act(name, value)` is called with what a hand has done. */
  constructor(act) {
    this.act = act;
    this.svg = byId("mesh");
    this.items = [];
    this.mesh = null;
    this.locked = new Set();
    this.tool = "look";
    this.painting = new Painting();
    this.isPainting = false;
    this.level = 255;
    this.radius = 14;
    this.axisX = 0.5;
    this.unit = 1;
    this.box = [0, 0, 1, 1];
    this.held = null; // the vertex that is pulled: its name, and where it is
    this.brushAt = [0.5, 0.5];
    this.listen();
    new ResizeObserver(() => this.fit()).observe(byId("stage"));
  }

  // --- what is shown ---

  showPicture(id, { target, frame, has_picture }) {
    const [x, y, width, height] = frame.map(value => value * SCALE), whole = { x: 0, y: 0, width: SCALE, height: SCALE };
    this.box = frame;
    const picture = has_picture ? [make("image", { x, y, width, height, href: `pictures/${id}/picture.png`, preserveAspectRatio: "none" })] : [];
    byId("photo").replaceChildren(...picture);
    byId("target").replaceChildren(...(target ? [
      make("mask", { id: "shape" }, make("image", { ...whole, href: target })),
      make("rect", { ...whole, mask: "url(#shape)" })] : []));
    this.fit();
  }

  /** A mesh as the server tells it; one whose faces are rings is drawn as one shape. */
  showMesh(mesh) {
    const focused = this.items.find(item => item.element === document.activeElement)?.name;
    this.mesh = mesh;
    if (!mesh || mesh.rings) {
      this.items = [];
      for (const group of ["vertices", "edges", "faces"]) byId(group).replaceChildren();
      if (mesh) this.showRings(mesh);
      return;
    }
    this.mesh.edges = edgesOf(mesh.faces);
    this.items = elementsOf(this.mesh);
    this.showLocked(this.locked);
    const item = this.items.find(one => one.name === focused) || this.items[0];
    item?.element.setAttribute("tabindex", 0);
    if (focused) item?.element.focus({ preventScroll: true });
    this.place();
  }

  showRings(mesh) {
    const at = id => mesh.vertices[id].map(value => value * SCALE);
    const path = Object.values(mesh.faces).map(face => `M${face.map(at).join("L")}Z`).join("");
    byId("faces").replaceChildren(make("g", { class: "face" }, make("path", { class: "seen", d: path, "fill-rule": "evenodd" })));
    byId("edges").replaceChildren(make("g", { class: "edge" }, make("path", { class: "seen", d: path, fill: "none", "vector-effect": "non-scaling-stroke" })));
  }

  showTried(rings) {
    const path = (rings || []).map(ring => `M${ring.map(([x, y]) => [x * SCALE, y * SCALE]).join("L")}Z`).join("");
    byId("tried").replaceChildren(...(path ? [make("path", { d: path })] : []));
  }

  showLocked(ids) {
    this.locked = new Set(ids);
    for (const { kind, id, name, element } of this.items)
      if (kind === "vertex") {
        const isLocked = this.locked.has(+id);
        element.classList.toggle("locked", isLocked);
        element.setAttribute("aria-label", isLocked ? `${name}, locked` : name);
      }
  }

  async loadPaint(id, isPainted) {
    this.painting.take(isPainted ? new Uint8Array(await (await fetch(`pictures/${id}/importance`)).arrayBuffer()) : []);
    this.showPaint();
  }

  showPaint() {
    const whole = { x: 0, y: 0, width: SCALE, height: SCALE };
    byId("painted").replaceChildren(...(this.painting.isPlain ? [] : [make("image", { ...whole, href: this.painting.picture() })]));
  }

  at(id) { return (this.held && this.held.id === id ? this.held.at : this.mesh.vertices[id]).map(value => value * SCALE); }

  place() {
    for (const item of this.items) place(item, item.points.map(id => this.at(id)), this.unit);
  }

  /** Fit the drawing into its place. */
  fit() {
    const [x, y, width, height] = this.box.map(value => value * SCALE), margin = MARGIN * Math.max(width, height);
    const viewBox = [x - margin, y - margin, width + 2 * margin, height + 2 * margin].join(" ");
    for (const svg of [byId("under"), this.svg]) set(svg, { viewBox });
    const matrix = this.svg.getScreenCTM();
    if (!matrix || !matrix.a) return;
    this.unit = 1 / matrix.a;
    this.place();
    this.showTools();
  }

  // --- tools ---

  choose(tool) {
    this.tool = tool;
    this.chosen = null;
    this.release();
    this.svg.dataset.tool = tool;
    byId("tool-told").textContent = TOLD[tool];
    byId("tip").textContent = TOLD[tool];
    byId("tip").hidden = tool === "look";
    byId("brushes").hidden = tool !== "paint";
    byId("axes").hidden = tool !== "axis";
    this.showTools();
    this.place();
  }

  showTools() {
    const hadFocus = document.activeElement?.closest?.("#brush, #axis");
    const x = this.axisX * SCALE, y0 = this.box[1] * SCALE, y1 = (this.box[1] + this.box[3]) * SCALE;
    byId("axis").replaceChildren(...(this.tool !== "axis" ? [] : [make("g", {
      tabindex: 0, role: "slider", "aria-label": "Axis", "aria-valuemin": 0, "aria-valuemax": 1, "aria-valuenow": this.axisX.toFixed(3), "aria-orientation": "horizontal",
    }, make("line", { x1: x, x2: x, y1: y0, y2: y1 }), make("line", { class: "grip", x1: x, x2: x, y1: y0, y2: y1 }), make("circle", { cx: x, cy: y0, r: 7 * this.unit }))]));
    const [bx, by] = this.brushAt.map(value => value * SCALE);
    byId("brush").replaceChildren(...(this.tool !== "paint" ? [] : [make("g", {
      tabindex: 0, role: "button", "aria-label": `Brush at ${this.brushAt.map(value => value.toFixed(2)).join(", ")}: arrows move it, space paints`,
    }, make("circle", { cx: bx, cy: by, r: (this.radius / SIDE) * SCALE }))]));
    if (hadFocus) byId(this.tool === "axis" ? "axis" : "brush").firstChild?.focus({ preventScroll: true });
  }

  /** Where a pointer is, in the unit square. */
  where(event) {
    const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.svg.getScreenCTM().inverse());
    return [point.x / SCALE, point.y / SCALE];
  }

  itemOf(target) { return this.items.find(item => item.element === target.closest?.("#mesh g[role]")); }

  /** What a click, or Enter, does with an element. */
  use(item) {
    const ends = item.kind === "edge" ? item.points.map(Number) : null;
    if (item.kind === "vertex" && this.tool === "lock") this.act("lock", +item.id);
    else if (item.kind === "vertex" && this.tool === "split") this.corner(item);
    else if (item.kind === "vertex" && this.tool === "dissolve") this.act("edit", { do: "vertex_dissolve", element: { vertex: +item.id } });
    else if (ends && this.tool === "dissolve") this.act("edit", { do: "edge_dissolve", element: { edge: ends } });
    else if (item.kind === "face" && this.tool === "delete") this.act("edit", { do: "face_delete", element: { face: +item.id } });
    else if (ends && this.tool === "add") this.act("edit", { do: "edge_subdivide", element: { edge: ends } });
    else if (ends && this.tool === "extrude") this.act("edit", { do: "edge_extrude", element: { edge: ends } });
  }

  /** The first or second of two corners that are to be joined. */
  corner(item) {
    if (!this.chosen || this.chosen === item) {
      this.chosen = this.chosen ? null : item;
      item.element.classList.toggle("chosen", Boolean(this.chosen));
      return;
    }
    const [a, b] = [+this.chosen.id, +item.id];
    this.chosen.element.classList.remove("chosen");
    this.chosen = null;
    const apart = face => Math.abs(face.indexOf(a) - face.indexOf(b)) % (face.length - 1) > 1;
    const found = Object.entries(this.mesh.faces).find(([, face]) => face.includes(a) && face.includes(b) && apart(face));
    if (!found) return this.act("say", "Choose two corners of one face that no edge joins yet.");
    this.act("edit", { do: "face_split", element: { face: +found[0], vertex: a }, choice: { to: b } });
  }

  // --- pulling ---

  grab(id) { this.held = { id, at: [...this.mesh.vertices[id]] }; }

  release() {
    this.held = null;
    if (this.mesh && !this.mesh.rings) this.place();
  }

  drop() {
    const { id, at } = this.held;
    const [x0, y0] = this.mesh.vertices[id];
    if (Math.hypot(at[0] - x0, at[1] - y0) < 1e-4) return this.release();
    this.act("edit", { do: "pull", vertex: +id, to: at.map(value => clamp(value, 0, 1)) });
  }

  // --- pointer and keys ---

  listen() {
    const svg = this.svg;
    let dragging = "", last = null;
    svg.addEventListener("pointerdown", event => {
      if (event.button || !this.mesh && this.tool !== "paint" && this.tool !== "axis") return;
      const item = this.itemOf(event.target);
      if (this.tool === "paint") {
        dragging = "paint";
        this.isPainting = true;
        last = this.where(event);
        this.painting.stroke(last, last, this.radius, this.level);
        this.showPaint();
      } else if (this.tool === "axis" && event.target.closest("#axis")) dragging = "axis";
      else if (this.tool === "pull" && item?.kind === "vertex") {
        dragging = "pull";
        this.grab(item.id);
      } else return;
      event.preventDefault();
      svg.setPointerCapture(event.pointerId);
    });
    svg.addEventListener("pointermove", event => {
      const now = this.where(event);
      if (this.tool === "paint") { this.brushAt = now; this.showTools(); }
      if (dragging === "paint") {
        this.painting.stroke(last, now, this.radius, this.level);
        last = now;
        this.showPaint();
      } else if (dragging === "axis") {
        this.axisX = clamp(now[0], 0.02, 0.98);
        this.showTools();
      } else if (dragging === "pull") {
        this.held.at = now;
        this.place();
      }
    });
    const end = event => {
      const was = dragging;
      dragging = "";
      this.isPainting = false;
      if (was === "paint") this.act("paint", this.painting.levels);
      else if (was === "axis") this.act("axis", this.axisX);
      else if (was === "pull" && event.type === "pointerup") this.drop();
      else if (was === "pull") this.release();
    };
    svg.addEventListener("pointerup", end);
    svg.addEventListener("pointercancel", end);
    svg.addEventListener("click", event => { const item = this.itemOf(event.target); if (item) this.use(item); });
    svg.addEventListener("keydown", event => this.onKey(event));
    this.listenForNames();
  }

  onKey(event) {
    const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const length = NUDGE * (event.shiftKey ? FAR : 1), isDoing = event.key === "Enter" || event.key === " ";
    if (!way && !isDoing && event.key !== "Escape") return;
    if (event.target.closest("#axis")) {
      if (way) { this.axisX = clamp(this.axisX + way[0] * length, 0.02, 0.98); this.showTools(); }
      if (isDoing) this.act("axis", this.axisX);
    } else if (event.target.closest("#brush")) {
      if (way) this.brushAt = this.brushAt.map((value, k) => clamp(value + 4 * way[k] * length, 0, 1));
      if (isDoing) {
        this.painting.stroke(this.brushAt, this.brushAt, this.radius, this.level);
        this.showPaint();
        this.act("paint", this.painting.levels);
      }
      this.showTools();
    } else this.onElementKey(event, way, length, isDoing);
    event.preventDefault();
    event.stopPropagation();
  }

  onElementKey(event, way, length, isDoing) {
    const item = this.itemOf(event.target);
    if (!item) return;
    if (this.held) {
      if (way) this.held.at = this.held.at.map((value, k) => clamp(value + way[k] * length, 0, 1));
      if (event.key === "Escape") this.release();
      else if (isDoing) this.drop();
      this.place();
    } else if (isDoing && this.tool === "pull" && item.kind === "vertex") this.grab(item.id);
    else if (isDoing) this.use(item);
    else if (way && way[1]) Drawing.walk(this.items, way[1]);
  }

  listenForNames() {
    const tag = byId("tag");
    const show = item => {
      for (const other of this.items) other.element.classList.toggle("named", other === item);
      tag.hidden = !item;
      if (!item) return;
      tag.textContent = this.locked.has(+item.id) && item.kind === "vertex" ? `${item.name}, locked` : item.name;
      const box = item.element.getBoundingClientRect(), frame = byId("stage").getBoundingClientRect();
      const x = clamp(box.x + box.width / 2 - frame.x - tag.offsetWidth / 2, 4, frame.width - tag.offsetWidth - 4);
      const above = box.y + (item.kind === "vertex" ? 0 : box.height / 2) - frame.y - tag.offsetHeight - 6;
      tag.style.transform = `translate(${x}px, ${Math.max(2, above)}px)`;
    };
    this.svg.addEventListener("pointerover", event => { if (!this.held) show(this.itemOf(event.target)); });
    this.svg.addEventListener("pointerleave", () => show(null));
    byId("stage").addEventListener("focusin", event => show(this.itemOf(event.target)));
    byId("stage").addEventListener("focusout", () => show(null));
  }
}
