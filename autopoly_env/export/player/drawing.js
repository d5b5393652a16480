
// What the player and the studio draw alike: the elements of a mesh, and a curve of scores.
"use strict";
const Drawing = (() => {
  const SCALE = 1000; // drawing units a unit square
  const VERTEX_PX = 3.6, HIT_PX = 11;
  const CURVE_INSET = 9, CURVE_TOP = 16, CURVE_BOTTOM = 6; // pixels; the inset is half a slider's thumb
  const MANY_POINTS = 60; // of a curve, above which only the one that is looked at is drawn
  const DRAWN = ["svg", "g", "path", "line", "circle", "text", "mask", "image", "rect", "title"];

  const byId = id => document.getElementById(id);
  const set = (element, attributes) => { for (const name in attributes) element.setAttribute(name, attributes[name]); };
  const clamp = (value, low, high) => Math.min(high, Math.max(low, value));

  function make(kind, attributes = {}, ...children) {
    const isDrawn = DRAWN.includes(kind);
    const element = isDrawn ? document.createElementNS("http://www.w3.org/2000/svg", kind) : document.createElement(kind);
    set(element, attributes);
    element.append(...children);
    return element;
  }

  /** The edges of faces, by name: their ends, the smaller id first. */
  function edgesOf(faces) {
    const edges = {};
    for (const face of Object.values(faces))
      face.forEach((a, i) => {
        const b = face[(i + 1) % face.length];
        edges[`${Math.min(a, b)}–${Math.max(a, b)}`] = [Math.min(a, b), Math.max(a, b)];
      });
    return edges;
  }

  /** Elements for a mesh, put into #vertices, #edges and #faces: what each is called, and the ids of its corners. */
  function elementsOf({ vertices, edges, faces }) {
    const items = [];
    const add = (kind, id, points, ...children) => {
      const element = make("g", { class: kind, tabindex: -1, role: "img", "aria-label": `${kind} ${id}` }, ...children);
      items.push({ name: `${kind} ${id}`, kind, id, element, points });
      return element;
    };
    byId("vertices").replaceChildren(...Object.keys(vertices).map(id =>
      add("vertex", id, [id], make("circle", { class: "hit" }), make("circle", { class: "seen" }))));
    byId("edges").replaceChildren(...Object.entries(edges).map(([id, ends]) =>
      add("edge", id, ends, make("line", { class: "hit" }), make("line", { class: "seen" }))));
    byId("faces").replaceChildren(...Object.entries(faces).map(([id, corners]) =>
      add("face", id, corners, make("path", { class: "seen" }))));
    return items;
  }

  /** Put an element where its corners are, in drawing units; `unit` is a pixel in them. */
  function place({ kind, element }, places, unit, radius = VERTEX_PX) {
    if (kind === "face") return element.firstChild.setAttribute("d", `M${places.join("L")}Z`);
    if (kind === "edge") {
      for (const line of element.children)
        set(line, { x1: places[0][0], y1: places[0][1], x2: places[1][0], y2: places[1][1] });
      return;
    }
    set(element.firstChild, { cx: places[0][0], cy: places[0][1], r: HIT_PX * unit });
    set(element.lastChild, { cx: places[0][0], cy: places[0][1], r: radius * unit });
  }

  /** Move the focus from one element of a mesh to the next, as arrow keys do. */
  function walk(items, change) {
    const i = items.findIndex(item => item.element === document.activeElement);
    const item = items[(i + change + items.length) % items.length];
    for (const other of items) other.element.setAttribute("tabindex", -1);
    item.element.setAttribute("tabindex", 0);
    item.element.focus({ preventScroll: true });
  }

  /** Where a share, 0 to 1, of the curve's width is, in pixels. */
  const curveX = share => CURVE_INSET + (byId("curve").clientWidth - 2 * CURVE_INSET) * share;

  /** Draw values into #curve, each at its share of the width; `now` is the number of the one that is looked at. */
  function curve(shares, values, now, titleOf) {
    const low = Math.min(...values), high = Math.max(...values), best = values.indexOf(high);
    const bottom = byId("curve").clientHeight - CURVE_BOTTOM;
    const points = values.map((value, k) => [curveX(shares[k]), bottom - (bottom - CURVE_TOP) * (high > low ? (value - low) / (high - low) : 0.5)]);
    const path = list => list.length ? `M${list.join("L")}` : "";
    const [first, last] = [points[0], points[points.length - 1]];
    set(byId("area"), { d: `${path(points)}L${[last[0], bottom + CURVE_BOTTOM]}L${[first[0], bottom + CURVE_BOTTOM]}Z` });
    set(byId("behind"), { d: path(points.slice(0, now + 1)) });
    set(byId("ahead"), { d: path(points.slice(now)) });
    const isMany = values.length > MANY_POINTS + 1;
    byId("dots").replaceChildren(...points.flatMap(([cx, cy], k) => {
      if (isMany && k !== now) return [];
      const kind = k === now ? "current" : k < now ? "past" : "ahead";
      return [make("circle", { cx, cy, r: k === now ? 6 : 2.4, class: kind }, make("title", {}, titleOf(k)))];
    }));
    const share = shares[best], anchor = share > 0.85 ? "end" : share < 0.15 ? "start" : "middle";
    byId("dots").append(make("text", { x: points[best][0], y: points[best][1] - 10, "text-anchor": anchor }, `best ${high.toFixed(2)}`));
    return best;
  }

  return { SCALE, VERTEX_PX, byId, set, clamp, make, edgesOf, elementsOf, place, walk, curve, CURVE_INSET };
})();
