
// The player. Time runs from 0, the start, to the number of steps: step k lasts from k - 1 to k. In the first part of
// it the mesh is still as before, with what to click marked, then the operator works, and in the rest the vertices move.
(() => {
  const { SCALE, VERTEX_PX, CURVE_INSET, byId, set, clamp, make, edgesOf, elementsOf, place, curve } = Drawing;
  const STEP_MS = 1300, HOLD_MS = 900; // a step's motion, and the rest after it when playing
  const SKIP_MS = 90, LONGEST_MS = 2600; // a further step when several are passed, and all of them together
  const PICK_SHARE = 0.3, OPERATOR_SHARE = 0.55; // of a step: until the operator works, and until it has
  const NAME_PX = 12.5, NAME_GAP_PX = 11, PRINTED_PX = 210; // a name, how far from its vertex; the width of a printed mesh
  const GROUPS = { vertex: "vertices", edge: "edges", face: "faces" };
  const MARGIN = 0.07, CHANGED_PX = 4.8; // of the box that is shown; a vertex that is new or has moved

  const data = JSON.parse(byId("data").textContent), steps = data.steps, last = steps.length - 1;
  const stage = byId("stage"), mesh = byId("mesh"), slider = byId("step"), tag = byId("tag");
  const still = matchMedia("(prefers-reduced-motion: reduce)");
  const hasParts = new Set(steps.map(step => step.part)).size > 1; // where all is one part nothing is said of it
  let shown = last, goal = last, playing = false, frame = 0, timer = 0;
  let built = "", elements = [], named = null, unit = 1, speed = 1;
  let isBefore = false, isHidden = false; // the mesh before the step is asked for; the step is to be guessed

  const ease = t => t * t * (3 - 2 * t);
  const between = (a, b, t) => [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t];

  // What a step's mesh consists of.
  for (const step of steps) {
    step.edges = edgesOf(step.faces);
    Object.assign(step, { put: {}, lost: {}, moved: [], takes: null, ...step });
    step.picks = new Set(step.picks);
  }

  // --- The mesh at a time ---

  /** Elements for the mesh of step `topology`, seen as part of step `k`: marked as new, moved, or about to go. */
  function build(topology, k, isPicking) {
    const key = `${topology}/${k}/${isPicking}`;
    if (key === built) return;
    built = key;
    const hadFocus = mesh.contains(document.activeElement);
    const before = steps[Math.max(k - 1, 0)], after = steps[k];
    elements = elementsOf(steps[topology]);
    for (const item of elements) {
      const { kind, id, element, name } = item, group = GROUPS[kind];
      Object.assign(item, { isNew: !(id in before[group]), goes: !(id in after[group]) });
      element.classList.toggle("new", item.isNew);
      element.classList.toggle("moved", kind === "vertex" && !isPicking && after.moved.includes(+id));
      element.classList.toggle("pick", isPicking && after.picks.has(name));
    }
    byId("names").replaceChildren(...elements.filter(item => isTold(item, k, isPicking)).map(item => {
      const id = item.name.split(" ")[1];
      return make("text", { "data-name": item.name }, item.kind === "face" ? item.name : id);
    }));
    byId("aims").replaceChildren(...(isPicking ? Object.keys(after.aims) : []).flatMap(id =>
      [make("circle", { class: "aim", "data-id": id }), make("text", { class: "aim", "data-id": id }, id)]));
    byId("trails").replaceChildren(...(topology === k ? after.moved : []).filter(id => id in before.vertices).map(id => make("line", { class: "trail", "data-id": id })));
    const item = elements.find(one => one.name === named) || elements[0];
    item.element.setAttribute("tabindex", 0);
    if (hadFocus) item.element.focus({ preventScroll: true });
    else if (item.name === named) item.element.classList.add("named");
    else hideTag();
  }

  /** Whether the card of step k speaks of an element: what is clicked, and what is made or moved, with all its corners. */
  function isTold({ name, kind, isNew, points }, k, isPicking) {
    const step = steps[k];
    if (isHidden) return false;
    if (step.picks.has(name)) return true;
    if (isPicking) return kind === "vertex" && points[0] in step.aims;
    return (isNew && kind !== "edge") || (kind === "vertex" && points[0] in step.aims);
  }

  /** Put the names beside their elements: of a vertex away from the middle of all, of the others on their middle. */
  function drawNames(at) {
    const [x0, y0, width, height] = data.box.map(value => value * SCALE), middle = [x0 + width / 2, y0 + height / 2];
    for (const text of byId("names").children) {
      const { kind, points } = elements.find(item => item.name === text.dataset.name);
      const places = points.map(at), mean = places.reduce((a, b) => [a[0] + b[0], a[1] + b[1]]).map(v => v / places.length);
      const away = kind === "vertex" ? [mean[0] - middle[0], mean[1] - middle[1]] : [0, 0];
      const length = Math.hypot(...away) || 1, gap = NAME_GAP_PX * unit;
      set(text, { x: mean[0] + (gap * away[0]) / length, y: mean[1] + (gap * away[1]) / length, "font-size": NAME_PX * unit });
    }
    for (const sign of byId("aims").children) {
      const [x, y] = steps[Math.ceil(shown)].aims[sign.dataset.id].map(value => value * SCALE);
      if (sign.tagName === "circle") set(sign, { cx: x, cy: y, r: 6 * unit });
      else set(sign, { x, y: y - (NAME_GAP_PX + 4) * unit, "font-size": NAME_PX * unit });
    }
  }

  /** Draw the moment `time`. */
  function draw(time) {
    const k = Math.ceil(time), part = k === 0 ? 1 : time - (k - 1), step = steps[k], before = steps[Math.max(k - 1, 0)];
    const appear = ease(clamp((part - PICK_SHARE) / (OPERATOR_SHARE - PICK_SHARE), 0, 1));
    const isPicking = k > 0 && part < PICK_SHARE;
    const settle = ease(clamp((part - OPERATOR_SHARE) / (1 - OPERATOR_SHARE), 0, 1));
    build(isPicking || (step.takes && appear < 1) ? k - 1 : k, k, isPicking && !isHidden);
    const at = id => {
      const [old, put, lost, now] = [before.vertices[id], step.put[id], step.lost[id], step.vertices[id]];
      const start = isPicking ? old : put ? between(put, put.slice(2), appear) : lost ? between(old, lost, appear) : old;
      return (now && !isPicking ? between(start, now, settle) : start).map(value => value * SCALE);
    };
    for (const item of elements) {
      const { kind, element, points, isNew, goes } = item;
      const fades = goes && (step.takes === "all" || step.takes === kind);
      if (kind === "face") element.style.setProperty("--new", `${100 * appear}%`);
      element.style.opacity = fades ? 1 - appear : isNew && kind !== "face" ? appear : 1;
      place(item, points.map(at), unit, isNew || element.classList.contains("moved") ? CHANGED_PX : VERTEX_PX);
    }
    for (const line of byId("trails").children) {
      const [x1, y1] = before.vertices[line.dataset.id].map(value => value * SCALE), [x2, y2] = at(line.dataset.id);
      set(line, { x1, y1, x2, y2 });
    }
    drawNames(at);
    if (named) showTag(named);
  }

  /** Fit the drawing into its place: the box of everything, and the size of a pixel in it. */
  function fit() {
    const [x, y, width, height] = data.box.map(value => value * SCALE), margin = MARGIN * Math.max(width, height);
    set(mesh, { viewBox: [x - margin, y - margin, width + 2 * margin, height + 2 * margin].join(" ") });
    unit = 1 / mesh.getScreenCTM().a;
    drawCurve();
    draw(shown);
    reveal();
  }

  // --- Names of elements ---

  const itemOf = target => elements.find(item => item.element === target.closest("#mesh g[role]"));

  function showTag(name) {
    const item = elements.find(one => one.name === name);
    if (!item) return hideTag();
    if (named !== name) hideTag();
    named = name;
    const step = steps[Math.ceil(shown)], matrix = mesh.getScreenCTM(), frame = stage.getBoundingClientRect();
    const box = item.element.getBBox(), isVertex = item.kind === "vertex";
    const place = isVertex && step.vertices[item.points[0]];
    tag.textContent = place ? `${name} · ${place[0].toFixed(3)}, ${place[1].toFixed(3)}` : name;
    tag.hidden = false;
    item.element.setAttribute("aria-label", tag.textContent);
    item.element.classList.add("named");
    const x = (box.x + box.width / 2) * matrix.a + matrix.e - frame.left - tag.offsetWidth / 2;
    const middle = (box.y + box.height / 2) * matrix.d + matrix.f - frame.top;
    const y = middle - tag.offsetHeight - 9 < 2 ? middle + 12 : middle - tag.offsetHeight - 9;
    tag.style.transform = `translate(${clamp(x, 4, frame.width - tag.offsetWidth - 4)}px, ${clamp(y, 2, frame.height - tag.offsetHeight - 4)}px)`;
  }

  function hideTag() {
    for (const item of elements) item.element.classList.remove("named");
    named = null;
    tag.hidden = true;
  }

  mesh.addEventListener("pointerover", event => { const item = itemOf(event.target); item ? showTag(item.name) : hideTag(); });
  mesh.addEventListener("pointerleave", () => hideTag());
  // On the HTML around it: an SVG element that listens for focus becomes a stop of the tab key itself.
  stage.addEventListener("focusin", event => { const item = itemOf(event.target); if (item) showTag(item.name); });
  stage.addEventListener("focusout", event => { if (event.relatedTarget) hideTag(); });
  mesh.addEventListener("keydown", event => {
    const change = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (!change) return;
    Drawing.walk(elements, change);
    event.preventDefault();
  });

  // --- The score curve ---

  function drawCurve() {
    const totals = steps.map(step => step.total), now = Math.round(goal), high = Math.max(...totals);
    const best = curve(totals.map((_, k) => (last ? k / last : 0)), totals, now, k => `step ${k}: ${totals[k].toFixed(2)}`);
    byId("curve").setAttribute("aria-label", `Score r_all by step: ${totals[0].toFixed(2)} at the start, best ${high.toFixed(2)} at step ${best}, ${totals[last].toFixed(2)} at the end`);
  }

  byId("curve").addEventListener("click", event => {
    const width = byId("curve").clientWidth - 2 * CURVE_INSET;
    const x = event.clientX - byId("curve").getBoundingClientRect().left - CURVE_INSET;
    stop();
    go(Math.round(clamp(x / width, 0, 1) * last));
  });

  // --- Words ---

  function keysOf(text) {
    return text.split("`").map((part, i) => (i % 2 ? make("kbd", {}, part) : part));
  }

  const linesOf = step => step.lines.map(line => make("li", {}, ...keysOf(line.words), make("span", { class: "state" }, line.state)));

  function tell(k) {
    const step = steps[k], which = k === 0 ? "Start" : `Step ${k} of ${last}`;
    byId("total").textContent = step.total.toFixed(2);
    byId("iou").textContent = step.iou.toFixed(3);
    byId("crossed").hidden = !step.crossings;
    byId("crossings").textContent = step.crossings;
    ["n-vertices", "n-edges", "n-faces"].forEach((id, i) => { byId(id).textContent = step.counts[i]; });
    byId("count").textContent = `${k} / ${last}`;
    byId("which").textContent = k === 0 ? `Before step 1 of ${last}` : which;
    byId("part").textContent = hasParts && k > 0 ? step.part : "";
    byId("what").textContent = step.title;
    byId("done").textContent = step.done;
    byId("why").textContent = step.why;
    byId("backdrop").hidden = k > 0 || !data.target;
    byId("seconds").textContent = k === 0 ? "" : `, about ${step.seconds.toFixed(0)} s`;
    byId("keys").replaceChildren(...linesOf(step));
    byId("menu").replaceChildren(make("span", {}, step.menu), make("code", {}, step.blender));
    set(slider, { "aria-valuetext": `${which}, ${step.title}` });
    slider.value = k;
    slider.style.setProperty("--filled", `${last ? (100 * k) / last : 0}%`);
    byId("previous").setAttribute("aria-disabled", k === 0);
    byId("next").setAttribute("aria-disabled", k === last);
    const [vertices, edges, faces] = step.counts;
    set(mesh, { "aria-label": `Mesh: ${which}, vertices ${vertices}, edges ${edges}, faces ${faces}` });
    document.querySelectorAll("#steps button").forEach((button, i) => {
      if (i === k) button.setAttribute("aria-current", "step");
      else button.removeAttribute("aria-current");
    });
    reveal();
    drawCurve();
  }

  /** Scroll the list, where it scrolls, so that the current step and those beside it are seen. */
  function reveal() {
    const list = byId("steps"), item = list.children[goal], top = item.offsetTop - list.offsetTop;
    list.scrollTop = clamp(list.scrollTop, top + 2 * item.offsetHeight - list.clientHeight, top - item.offsetHeight);
  }

  byId("steps").append(...steps.map((step, k) => {
    const gain = k ? step.total - steps[k - 1].total : 0, sign = gain < 0 ? "−" : "+";
    const gained = k ? `${sign}${Math.abs(gain).toFixed(2)}` : step.total.toFixed(2);
    const part = (name, text) => make("span", { class: name }, text);
    const button = make("button", { type: "button" }, part("number", k), part("title", step.title), part("gain", gained));
    button.addEventListener("click", () => { stop(); go(k); });
    const isFirst = hasParts && step.part !== steps[k - 1]?.part;
    return make("li", {}, ...(isFirst ? [make("p", { class: "part" }, step.part)] : []), button);
  }));
  byId("lesson").replaceChildren(...data.lesson.map(words => make("li", {}, words)));

  // --- Motion ---

  /** Go to step k, through all that lies between. */
  function go(k, toBefore = false) {
    cancelAnimationFrame(frame);
    goal = clamp(k, 0, last);
    isHidden = byId("guess").checked && goal > 0 && !toBefore && !playing && goal !== revealed;
    isBefore = goal > 0 && (toBefore || isHidden);
    document.body.classList.toggle("guessing", isHidden);
    byId("reveal").hidden = !isHidden;
    byId("before").setAttribute("aria-pressed", isBefore);
    byId("after").setAttribute("aria-pressed", !isBefore);
    tell(goal);
    const end = isBefore ? goal - 1 + PICK_SHARE / 2 : goal;
    if (still.matches || isBefore) { shown = end; draw(shown); return arrive(); }
    const from = shown, way = Math.abs(goal - from), begun = performance.now();
    const duration = (way <= 1 ? STEP_MS * way : Math.min(LONGEST_MS, STEP_MS + SKIP_MS * (way - 1))) / speed;
    const move = () => {
      const part = duration ? clamp((performance.now() - begun) / duration, 0, 1) : 1;
      shown = part === 1 ? goal : from + (goal - from) * part;
      draw(shown);
      if (part < 1) frame = requestAnimationFrame(move);
      else arrive();
    };
    frame = requestAnimationFrame(move);
  }

  function arrive() {
    clearTimeout(timer);
    if (playing && goal === last) stop();
    if (playing) timer = setTimeout(() => go(goal + 1), (still.matches ? STEP_MS + HOLD_MS : HOLD_MS) / speed);
  }

  function stop() {
    playing = false;
    clearTimeout(timer);
    showPlaying();
  }

  function toggle() {
    if (playing) return stop();
    playing = true;
    showPlaying();
    if (goal === last) { shown = goal = 0; tell(0); draw(0); arrive(); }
    else go(goal + 1);
  }

  function showPlaying() {
    document.body.classList.toggle("playing", playing);
    byId("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  }

  // --- Before and after, speed, guessing, print ---

  let revealed = -1; // the step that was guessed last and may be seen
  byId("before").addEventListener("click", () => { stop(); go(Math.max(goal, Math.min(1, last)), true); });
  byId("after").addEventListener("click", () => { stop(); revealed = goal; go(goal); });
  byId("reveal").addEventListener("click", () => { revealed = goal; go(goal); });
  byId("guess").addEventListener("change", () => { stop(); revealed = -1; go(goal); });
  byId("speed").addEventListener("change", event => { speed = +event.target.value; });
  byId("show-names").addEventListener("change", event => mesh.classList.toggle("nameless", !event.target.checked));
  byId("print").addEventListener("click", () => print());

  /** The drawing at a time, as a picture of its own. */
  function picture(time) {
    shown = time;
    built = "";
    draw(time);
    const copy = mesh.cloneNode(true), shape = copy.querySelector("mask");
    for (const group of copy.querySelectorAll("g[id]")) {
      group.classList.add(group.id);
      group.removeAttribute("id");
    }
    if (shape) {
      shape.id = `shape-${time}`;
      set(copy.querySelector("[mask]"), { mask: `url(#shape-${time})` });
    }
    for (const name of ["id", "role", "aria-label", "aria-describedby"]) copy.removeAttribute(name);
    for (const group of copy.querySelectorAll("[tabindex]")) group.removeAttribute("tabindex");
    return copy;
  }

  /** A card for each step, with the mesh before and after it, for paper. */
  addEventListener("beforeprint", () => {
    const now = shown, wasHidden = isHidden, onScreen = unit;
    isHidden = false;
    hideTag();
    unit = mesh.viewBox.baseVal.width / PRINTED_PX;
    byId("printed").replaceChildren(...steps.map((step, k) => {
      const pictures = (k ? [k - 1 + PICK_SHARE / 2, k] : [0]).map(time => make("figure", {}, picture(time)));
      const head = k === 0 ? step.title : `Step ${k} of ${last}${hasParts ? `, ${step.part}` : ""}: ${step.title}`;
      const words = [make("h2", {}, head), make("p", {}, `${step.done} ${step.why}`), make("ol", {}, ...linesOf(step))];
      return make("article", {}, make("div", { class: "pictures" }, ...pictures), make("div", {}, ...words));
    }));
    isHidden = wasHidden;
    shown = now;
    unit = onScreen;
    built = "";
    draw(now);
  });
  addEventListener("afterprint", () => byId("printed").replaceChildren());

  byId("play").addEventListener("click", toggle);
  byId("previous").addEventListener("click", () => { stop(); go(goal - 1); });
  byId("next").addEventListener("click", () => { stop(); go(goal + 1); });
  slider.addEventListener("input", () => { stop(); go(+slider.value); });
  document.addEventListener("keydown", event => {
    const isRange = event.target.type === "range", isPressed = event.target.closest?.("button, input, select");
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === " " && (isRange || !isPressed)) toggle();
    else if (isRange) return;
    else if (event.key === "ArrowRight") { stop(); go(goal + 1); }
    else if (event.key === "ArrowLeft") { stop(); go(goal - 1); }
    else if (event.key === "b" && goal > 0) { stop(); revealed = goal; go(goal, !isBefore); }
    else if (event.key === "Home") { stop(); go(0); }
    else if (event.key === "End") { stop(); go(last); }
    else return;
    event.preventDefault();
  });

  // --- The target ---

  function showTarget() {
    const isOn = byId("show-target").checked, opacity = byId("opacity");
    opacity.disabled = !isOn;
    opacity.style.setProperty("--filled", `${opacity.value}%`);
    opacity.setAttribute("aria-valuetext", `${opacity.value} %`);
    byId("target").style.opacity = isOn ? opacity.value / 100 : 0;
    byId("legend-target").hidden = !isOn;
  }

  if (data.target) {
    const whole = { x: 0, y: 0, width: SCALE, height: SCALE };
    byId("target").append(
      make("mask", { id: "shape" }, make("image", { ...whole, href: data.target })),
      make("rect", { ...whole, mask: "url(#shape)" }));
    byId("overlay").hidden = false;
    const name = `${data.title.replace(/[^\w-]+/g, "_").slice(0, 60)}.png`;
    byId("backdrop").append(
      "To have the picture behind the mesh: ", make("a", { href: data.target, download: name }, "save it"),
      "; ", make("kbd", {}, "Shift"), " ", make("kbd", {}, "A"), " › Image › Reference, and choose it. In the sidebar (",
      make("kbd", {}, "N"), ", Item) Location 0.5, 0.5, −0.01 and Rotation 0, 0, 0; in its Object Data properties Size 1.");
    byId("show-target").addEventListener("change", showTarget);
    byId("opacity").addEventListener("input", showTarget);
    showTarget();
  }

  const asked = /^#step-(\d+)$/.exec(location.hash);
  if (asked) shown = goal = Math.min(+asked[1], last);
  slider.max = last;
  new ResizeObserver(fit).observe(stage);
  fit();
  tell(goal);
})();
