// The panels beside the stage: what the object is, how is searched, what is taken along; and the list of all pictures.
import { save } from "./server.js";

const { byId, set, make } = Drawing;
export const PRICES = [3, 2, 1.5, 1, 0.7, 0.5, 0.4, 0.3, 0.2, 0.15, 0.1, 0.07, 0.05, 0.03, 0.02]; // from simple to true
const WORDS = { waiting: "waits", searching: "searching …", paused: "paused", failed: "no mesh", idle: "" };

// --- tabs ---

/** Tabs that arrow keys go through; `seen(name)` is told which one is looked at. */
export function makeTabs(seen) {
  const tabs = [...byId("tabs").children];
  const choose = (tab, focuses) => {
    for (const other of tabs) {
      const isChosen = other === tab;
      other.setAttribute("aria-selected", isChosen);
      other.tabIndex = isChosen ? 0 : -1;
      byId(other.getAttribute("aria-controls")).hidden = !isChosen;
    }
    if (focuses) tab.focus();
    seen(tab.id.replace("tab-", ""));
  };
  tabs.forEach((tab, k) => {
    tab.addEventListener("click", () => choose(tab, false));
    tab.addEventListener("keydown", event => {
      const change = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (change) { choose(tabs[(k + change + tabs.length) % tabs.length], true); event.stopPropagation(); }
    });
  });
  return name => choose(byId(`tab-${name}`), false);
}

// --- the object ---

const SWITCHED = { "has-background": "background-field", "has-threshold": "threshold-field", "has-alpha": "alpha-field", "has-specks": "specks-field" };

function objectOptions() {
  const isOn = name => byId(name).checked, options = {};
  const object = byId("object").value;
  options.object = object === "colour" ? byId("object-colour").value : object;
  if (isOn("has-background")) options.background = byId("background").value;
  if (isOn("has-threshold")) options.threshold = byId("threshold").value / 100;
  if (isOn("has-alpha")) options.alpha_threshold = byId("alpha").value / 100;
  if (isOn("has-specks")) byId("specks").value === "0" ? (options.keep_specks = true) : (options.min_speck = +byId("specks").value);
  return options;
}

export function makeObjectPanel(changed) {
  const tell = () => { showFields(); changed(objectOptions()); };
  for (const name of ["object", ...Object.keys(SWITCHED)]) byId(name).addEventListener("change", tell);
  for (const name of ["object-colour", "background", "threshold", "alpha", "specks"]) byId(name).addEventListener("input", tell);
}

function showFields() {
  byId("object-colour-field").hidden = byId("object").value !== "colour";
  for (const [name, field] of Object.entries(SWITCHED)) byId(field).hidden = !byId(name).checked;
  for (const name of ["threshold", "alpha", "specks"]) fill(byId(name));
}

export function showObject({ object, notes, problem, target }) {
  const isWord = ["auto", "dark", "light", "alpha"].includes(object.object);
  byId("object").value = isWord ? object.object : "colour";
  if (!isWord && /^#[0-9a-f]{6}$/i.test(object.object)) byId("object-colour").value = object.object;
  byId("has-background").checked = object.background !== null;
  if (/^#[0-9a-f]{6}$/i.test(object.background || "")) byId("background").value = object.background;
  byId("has-threshold").checked = object.threshold !== null;
  if (object.threshold !== null) byId("threshold").value = Math.round(100 * object.threshold);
  byId("has-alpha").checked = object.alpha_threshold !== null;
  if (object.alpha_threshold !== null) byId("alpha").value = Math.round(100 * object.alpha_threshold);
  byId("has-specks").checked = object.min_speck !== null || object.keep_specks;
  if (object.min_speck !== null) byId("specks").value = object.min_speck;
  if (object.keep_specks) byId("specks").value = 0;
  showFields();
  showNotes("notes", target ? notes : [`warning: ${problem}`]);
}

function showNotes(id, notes) {
  byId(id).replaceChildren(...notes.map(note => make("li", { class: note.startsWith("warning:") ? "warning" : "" }, note.replace(/^warning: /, ""))));
}

export function fill(slider) {
  slider.style.setProperty("--filled", `${(100 * (slider.value - slider.min)) / (slider.max - slider.min)}%`);
}

// --- the search ---

const radios = name => [...document.querySelectorAll(`input[name="${name}"]`)];
export const chosenOf = name => radios(name).find(radio => radio.checked).value;
export const choose = (name, value) => { for (const radio of radios(name)) radio.checked = radio.value === value; };

/** What is chosen, as the server takes it; `axis` is that of the stage. */
export function choices(seed, axis) {
  const number = id => byId(id).value === "" ? null : +byId(id).value, symmetry = byId("symmetry").value;
  return {
    style: chosenOf("style"), w_sc: PRICES[byId("price").value], seconds: number("seconds"), refits: number("refits"), seed,
    symmetry: symmetry === "axis" ? axis.toFixed(4) : symmetry || null,
    align: { "": null, yes: true, no: false }[byId("align").value], keep: byId("keep").value || null,
  };
}

export function makeSearchPanel(changed) {
  for (const radio of radios("style")) radio.addEventListener("change", changed);
  for (const id of ["symmetry", "align", "keep", "seconds", "refits"])
    byId(id).addEventListener("change", event => { if (event.target.checkValidity()) changed(); else event.target.reportValidity(); });
  byId("price").addEventListener("input", () => { tellPrice(); changed(); });
}

function tellPrice() {
  const price = PRICES[byId("price").value];
  byId("price-told").textContent = `${price} points an element`;
  byId("price").setAttribute("aria-valuetext", `${price} points an element`);
  fill(byId("price"));
}

export function showChoices(wanted) {
  choose("style", wanted.style);
  const nearest = PRICES.reduce((best, price, k) => Math.abs(Math.log(price / wanted.w_sc)) < Math.abs(Math.log(PRICES[best] / wanted.w_sc)) ? k : best, 0);
  byId("price").value = nearest;
  tellPrice();
  const active = document.activeElement?.id;
  for (const id of ["seconds", "refits"]) if (active !== id) byId(id).value = wanted[id] ?? "";
  byId("symmetry").value = wanted.symmetry === null || wanted.symmetry === "auto" ? "" : ["best", "off"].includes(wanted.symmetry) ? wanted.symmetry : "axis";
  byId("align").value = wanted.align === null ? "" : wanted.align ? "yes" : "no";
  byId("keep").value = wanted.keep ?? "";
}

export function showSaid(item) {
  const notes = item.version ? [item.version.told, ...item.version.notes] : [];
  showNotes("said", item.problem && item.target ? [`warning: ${item.problem}`, ...notes] : notes);
}

// --- taking along ---

export function makeTakePanel(kinds, state, say) {
  const link = kind => {
    const query = new URLSearchParams();
    for (const id of ["depth", "size"]) if (kind.heeds.includes(id) && byId(id).value !== "") query.set(id, byId(id).value);
    return `pictures/${state.id}/take/${encodeURIComponent(kind.name)}?${query}`;
  };
  byId("kinds").replaceChildren(...kinds.map(kind => {
    const button = make("button", { type: "button" }, make("b", {}, kind.suffix), make("span", {}, kind.help));
    button.addEventListener("click", () => save(link(kind)).catch(error => say(error.message)));
    return make("li", {}, button);
  }));
  byId("copy").addEventListener("click", async () => {
    await navigator.clipboard.writeText(byId("command").textContent);
    byId("copy").textContent = "Copied";
    setTimeout(() => { byId("copy").textContent = "Copy it"; }, 1500);
  });
}

export function showTaking({ id, name, version, has_picture }, say) {
  byId("nothing").hidden = Boolean(version);
  byId("things").hidden = !version;
  if (!version) return;
  byId("player").href = `pictures/${id}/player.html`;
  byId("command").hidden = byId("copy").hidden = !version.command;
  byId("command").textContent = version.command;
  const files = version.files.map(file => {
    const button = make("button", { type: "button" }, file);
    button.addEventListener("click", () => save(`pictures/${id}/file/${encodeURIComponent(file)}`).catch(error => say(error.message)));
    return button;
  });
  byId("command-files").replaceChildren(...files);
  byId("command-told").textContent = version.command
    ? `Put ${[has_picture ? `the picture, as ${name}.png,` : "the picture", ...version.files].join(" and ")} beside each other, and type:`
    : "A hand has had a part in it: the construction (.sequence.json) replays it, and `python -m agents.export` makes everything else of that.";
}

// --- all pictures ---

/** The pictures, the worst first: what has no mesh, then by score; then what is searched, and what waits. */
export function sortedWorstFirst(items) {
  const rank = item => ({ failed: 0, done: 1, idle: 1, paused: 2, searching: 2, waiting: 3 })[item.status];
  return [...items].sort((a, b) => rank(a) - rank(b) || (rank(a) === 1 ? (a.total ?? 0) - (b.total ?? 0) : a.id - b.id));
}

export function showList(items, current, open, close) {
  const focused = document.activeElement?.closest?.("#list li")?.dataset.id, focusedClass = document.activeElement?.className;
  const known = new Map([...byId("list").children].map(line => [line.dataset.id, line]));
  const lines = sortedWorstFirst(items).map(item => {
    const line = known.get(String(item.id)) || lineOf(item, open, close);
    const worth = item.status === "done" ? (item.total === null ? "" : item.total.toFixed(1)) : WORDS[item.status];
    line.className = item.status;
    line.querySelector(".worth").textContent = worth;
    const button = line.querySelector(".open");
    if (item.id === current) button.setAttribute("aria-current", "true");
    else button.removeAttribute("aria-current");
    return line;
  });
  const list = byId("list");
  lines.forEach((line, k) => { if (list.children[k] !== line) list.insertBefore(line, list.children[k] || null); });
  while (list.children.length > lines.length) list.lastChild.remove();
  if (focused && !list.contains(document.activeElement)) list.querySelector(`li[data-id="${focused}"] .${focusedClass}`)?.focus();
  const done = items.filter(item => item.total !== null).length;
  byId("pictures-title").textContent = items.length > 1 ? `Pictures: ${done} of ${items.length} done, the worst first` : "Pictures";
  byId("zip").hidden = done < 2;
}

function lineOf(item, open, close) {
  const button = make("button", { type: "button", class: "open" },
    make("img", { src: `pictures/${item.id}/small.png`, alt: "", loading: "lazy" }), make("span", { class: "called", title: item.name }, item.name), " ", make("span", { class: "worth" }));
  button.addEventListener("click", () => open(item.id));
  const cross = make("button", { type: "button", class: "close", "aria-label": `Close ${item.name}` }, "×");
  cross.addEventListener("click", () => close(item.id));
  return make("li", { "data-id": item.id }, button, cross);
}

export function showLike(items, current) {
  const others = items.filter(item => item.id !== current && item.total !== null), select = byId("like");
  byId("like-field").hidden = !others.length;
  const wanted = others.map(item => `${item.id}`).join();
  if (select.dataset.ids === wanted) return;
  select.dataset.ids = wanted;
  const before = select.value;
  select.replaceChildren(...others.map(item => make("option", { value: item.id }, item.name)));
  if (others.some(item => `${item.id}` === before)) select.value = before;
}

export const setDisabled = (id, isDisabled) => set(byId(id), { "aria-disabled": isDisabled });
