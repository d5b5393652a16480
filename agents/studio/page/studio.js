// The studio: hears the server's news, shows them, and tells it what is wanted.
import { ask, News, newestOnly, post, save, upload } from "./server.js";
import { Stage } from "./stage.js";
import {
  choices, chosenOf, fill, makeObjectPanel, makeSearchPanel, makeTabs, makeTakePanel, setDisabled, showChoices, showLike, showList, showObject, showSaid, showTaking,
} from "./panels.js";

const { byId, curve, make } = Drawing;
const AT_ONCE = 2, MOST_TOLD = 3, SETTLED_MS = 30; // uploads; of them that are refused; milliseconds
const state = { id: 0, item: null, items: [], live: null, target: "", paint: null, crew: { is_ready: true } };
let messageTimer = 0;

// --- saying ---

function say(text) {
  byId("message").firstElementChild.textContent = text;
  byId("message").hidden = false;
  clearTimeout(messageTimer);
  messageTimer = setTimeout(() => { byId("message").hidden = true; }, 12000);
}
byId("message").lastElementChild.addEventListener("click", () => { byId("message").hidden = true; });
const announce = text => { if (byId("live").textContent !== text) byId("live").textContent = text; };
const trying = promise => promise.catch(error => { say(error.message); if (state.item) showItem(state.item); });
const path = what => `pictures/${state.id}/${what}`;

// --- what a hand does on the stage ---

const stage = new Stage((name, value) => {
  if (name === "say") return say(value);
  if (name === "paint") return trying(ask(path("importance"), { method: "POST", body: stage.painting.isPlain ? new Uint8Array() : value.slice() }));
  if (name === "axis") { byId("symmetry").value = "axis"; return sendChoices(); }
  if (name === "edit") return trying(post(path("edit"), value)).finally(() => stage.release());
  if (name === "lock") {
    const ids = new Set(stage.locked);
    if (!ids.delete(value)) ids.add(value);
    stage.showLocked(ids); // at once, so that the next click adds to them
    return trying(post(path("locks"), { ids: [...ids] }));
  }
});
const sendChoices = () => sendNewest(choices(state.item.choices.seed, stage.axisX));
const sendNewest = newestOnly(value => trying(post(path("choices"), value)));
const sendObject = newestOnly(async value => {
  await trying(post(path("object"), value));
  await new Promise(done => setTimeout(done, SETTLED_MS)); // until the news of it have come
});

// --- news ---

const news = new News((kind, value, id) => {
  if (kind === "silence") return say("The server does not answer: has it been ended?");
  if (kind === "list") return hearList(value);
  if (kind === "crew") { state.crew = value; return showState(); }
  if (id !== state.id) return;
  if (kind === "item") { state.item = value; showItem(value); }
  if (kind === "live") showLive(value);
});

function hearList(items) {
  state.items = items;
  document.body.classList.toggle("empty", !items.length);
  byId("mesh").toggleAttribute("hidden", !items.length);
  if (!items.length) { state.id = 0; state.item = null; byId("name").textContent = "AutoPoly studio"; byId("facts").hidden = true; }
  else if (!items.some(item => item.id === state.id)) open(items[items.length - 1].id);
  showList(items, state.id, open, close);
  showLike(items, state.id);
}

function open(id) {
  if (id === state.id) return;
  Object.assign(state, { id, item: null, live: null, target: "", paint: null });
  location.hash = `#${id}`;
  stage.showTried(null);
  news.listen(id);
  showList(state.items, id, open, close);
  showLike(state.items, id);
}

const close = id => trying(ask(`pictures/${id}`, { method: "DELETE" }));

function showItem(item) {
  if (item.problem && item.target && item.problem !== state.problem) say(item.problem);
  state.problem = item.problem;
  byId("name").textContent = item.name;
  document.title = `${item.name} – AutoPoly studio`;
  const key = `${item.id} ${item.target}`;
  if (key !== state.target) {
    if (!state.target.startsWith(`${item.id} `)) {
      stage.axisX = item.version?.axis ?? item.best_axis;
      if (!item.target) selectTab("picture");
    }
    state.target = key;
    stage.showPicture(item.id, item);
  }
  if (item.paint !== state.paint && !stage.isPainting) { // in this tab or in another one
    state.paint = item.paint;
    trying(stage.loadPaint(item.id, item.is_painted));
  }
  if (!sendObject.isBusy) showObject(item); // else what is shown is newer than what has come
  if (!sendNewest.isBusy) showChoices(item.choices);
  showSaid(item);
  showTaking(item, say);
  const isBusy = ["searching", "waiting", "paused"].includes(item.status);
  if (!isBusy) { state.live = null; stage.showTried(null); }
  if (item.version && !state.live) showVersion(item.version);
  else if (!item.version && !state.live) stage.showMesh(null);
  stage.showLocked(item.locked);
  byId("locks").textContent = item.locked.length ? `Locked: ${item.locked.join(", ")}.` : "";
  showState();
}

function showVersion({ mesh, score, totals, n_steps }) {
  stage.showMesh(mesh);
  showFacts(score.total, score.iou, score.self_intersections, mesh.counts);
  drawCurve(totals.map((_, k) => (n_steps ? k / n_steps : 0)), totals, n_steps, k => `step ${k}: ${totals[k].toFixed(2)}`);
  byId("curve").setAttribute("aria-label", `Score by step of the construction: ${totals[0].toFixed(2)} at the start, ${totals[n_steps].toFixed(2)} after ${n_steps} steps`);
}

let drawn = null; // the curve, to be drawn again where its width changes
function drawCurve(...what) {
  drawn = what;
  curve(...what);
}
new ResizeObserver(() => { if (drawn) curve(...drawn); }).observe(byId("controls"));

function showFacts(total, iou, crossings, counts) {
  byId("facts").hidden = false;
  byId("total").textContent = total.toFixed(2);
  byId("iou").textContent = iou.toFixed(3);
  byId("crossed").hidden = !crossings;
  byId("crossings").textContent = crossings;
  ["n-vertices", "n-edges", "n-faces"].forEach((id, k) => { byId(id).textContent = counts[k]; });
}

function showLive(live) {
  if (!state.item || live.wish !== state.item.wish || stage.held) return;
  const isNew = JSON.stringify(live.mesh) !== JSON.stringify(state.live?.mesh);
  state.live = live;
  if (isNew) stage.showMesh(live.mesh);
  stage.showTried(live.tried);
  showFacts(live.best, live.iou, live.crossings, live.mesh.counts);
  const most = Math.max(1, live.refits), values = live.curve.map(point => point[1]);
  drawCurve(live.curve.map(point => point[0] / most), values, values.length - 1, k => `${live.curve[k][0]} refits: ${values[k].toFixed(2)}`);
  byId("curve").setAttribute("aria-label", `Score by tries: ${values[values.length - 1].toFixed(2)} after ${live.refits} refits`);
  showState();
}

/** What is going on, and which buttons do something. */
function showState() {
  const { item, live, crew } = state;
  if (!item) return;
  const isSearching = item.status === "searching", isPaused = item.status === "paused", isBusy = isSearching || isPaused || item.status === "waiting";
  document.body.classList.toggle("paused", isPaused);
  byId("play").setAttribute("aria-label", isPaused ? "Go on" : "Pause");
  setDisabled("play", !isSearching && !isPaused);
  setDisabled("stop", !isBusy);
  setDisabled("anew", !item.target);
  setDisabled("on", !item.version || isBusy);
  setDisabled("undo", !item.n_undo);
  setDisabled("redo", !item.n_redo);
  const worth = item.version ? `r_all ${item.version.score.total.toFixed(2)}` : "";
  const told = {
    searching: !crew.is_ready && !live ? "getting ready (the first time this takes minutes) …" : "searching", paused: "paused", waiting: "waits for its turn",
    done: item.version?.told ?? "", failed: item.version ? "no other mesh" : "no mesh", idle: "",
  }[item.status];
  byId("count").textContent = live && isBusy ? `${told}: ${live.refits} refits, ${live.seconds.toFixed(1)} s` : told;
  announce(item.status === "done" ? `${item.name}: ${worth}, ${item.version?.mesh.counts[2]} faces, ${told}` : `${item.name}: ${told} ${item.problem}`);
}

// --- what is dropped, pasted and chosen ---

async function add(files) {
  const list = [...files], waits = list.length > 1, refused = [];
  let next = 0, first = 0;
  const one = async () => {
    while (next < list.length) {
      const file = list[next++];
      try {
        const { id } = await upload(file, waits);
        if (!first) { first = id; if (!waits) open(id); }
      } catch (error) {
        refused.push(error.message);
        say(refused.length > MOST_TOLD ? `${refused.slice(0, MOST_TOLD).join(" – ")} – and ${refused.length - MOST_TOLD} more` : refused.join(" – "));
      }
    }
  };
  await Promise.all(Array.from({ length: AT_ONCE }, one));
  if (waits && first) open(first);
}

/** The files in what was dropped, those of folders, too. */
async function filesOf(transfer) {
  const entries = [...transfer.items].map(item => item.webkitGetAsEntry?.()).filter(Boolean);
  if (!entries.some(entry => entry.isDirectory)) return [...transfer.files];
  const found = [];
  const walk = async entry => {
    if (entry.isFile) return found.push(await new Promise((done, fail) => entry.file(done, fail)));
    const reader = entry.createReader();
    for (let part; (part = await new Promise((done, fail) => reader.readEntries(done, fail))).length;) for (const inner of part) await walk(inner);
  };
  for (const entry of entries) await walk(entry);
  return found.filter(file => /^image\//.test(file.type) || /\.(svg|json)$/i.test(file.name));
}

addEventListener("dragover", event => { event.preventDefault(); byId("veil").hidden = false; });
addEventListener("dragleave", event => { if (!event.relatedTarget) byId("veil").hidden = true; });
addEventListener("drop", async event => {
  event.preventDefault();
  byId("veil").hidden = true;
  await add(await filesOf(event.dataTransfer));
});
addEventListener("paste", event => {
  const files = [...event.clipboardData.files];
  if (files.length) { event.preventDefault(); add(files); }
});
for (const id of ["choose", "more"]) byId(id).addEventListener("click", () => byId("files").click());
byId("files").addEventListener("change", event => { add(event.target.files); event.target.value = ""; });

// --- buttons ---

const isOn = id => byId(id).getAttribute("aria-disabled") !== "true";
const doing = (id, what) => byId(id).addEventListener("click", () => { if (isOn(id)) trying(what()); });
doing("play", () => post(path("search"), { do: state.item.status === "paused" ? "go" : "pause" }));
doing("stop", () => post(path("search"), { do: "stop" }));
doing("anew", () => post(path("search"), { do: "anew" }));
doing("on", () => post(path("search"), { do: "on" }));
doing("undo", () => post(path("edit"), { do: "undo" }));
doing("redo", () => post(path("edit"), { do: "redo" }));
doing("retell", () => post(path("retell"), { from: +byId("like").value }));
doing("unpaint", () => { stage.painting.take([]); stage.showPaint(); return ask(path("importance"), { method: "POST", body: new Uint8Array() }); });
doing("axis-here", async () => { byId("symmetry").value = "axis"; await sendChoices(); });
doing("axis-off", async () => { byId("symmetry").value = "off"; await sendChoices(); });
byId("zip").addEventListener("click", () => save("results.zip").catch(error => say(error.message)));
for (const radio of document.querySelectorAll('input[name="tool"]')) radio.addEventListener("change", () => stage.choose(chosenOf("tool")));
for (const radio of document.querySelectorAll('input[name="brush"]')) radio.addEventListener("change", () => { stage.level = +chosenOf("brush"); });
byId("brush-size").addEventListener("input", event => { stage.radius = +event.target.value; fill(event.target); stage.showTools(); });
fill(byId("brush-size"));

document.addEventListener("keydown", event => {
  const isTyping = event.target.closest?.("input, select, textarea, button, [role=tab]");
  if ((event.ctrlKey || event.metaKey) && event.key.toLowerCase() === "z") byId(event.shiftKey ? "redo" : "undo").click();
  else if (event.ctrlKey || event.metaKey || event.altKey || isTyping || !state.item) return;
  else if (event.key === " ") byId("play").click();
  else if (event.key === "g") byId("on").click();
  else return;
  event.preventDefault();
});

const selectTab = makeTabs(name => {
  document.body.classList.toggle("seeing-picture", name === "picture");
  stage.choose(name === "hand" ? chosenOf("tool") : "look");
});
makeObjectPanel(options => sendObject(options));
makeSearchPanel(() => { if (state.item) sendChoices(); });
trying(ask("kinds").then(answer => answer.json()).then(kinds => makeTakePanel(kinds, state, say)));
function exampleLine(name) {
  const button = make("button", { type: "button" }, make("img", { src: `examples/${name}.png`, alt: "", loading: "lazy" }), name.replace(/_/g, " "));
  button.addEventListener("click", () => trying(ask(`examples/${name}`, { method: "POST" }).then(answer => answer.json()).then(({ id }) => open(id))));
  return make("li", {}, button);
}
trying(ask("examples").then(answer => answer.json()).then(names => {
  for (const list of document.querySelectorAll(".examples")) list.replaceChildren(...names.map(exampleLine));
}));
addEventListener("hashchange", () => {
  const id = Number(location.hash.slice(1));
  if (state.items.some(item => item.id === id)) open(id);
});
stage.choose("look");
state.id = Number(location.hash.slice(1)) || 0;
news.listen(state.id);
