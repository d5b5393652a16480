"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const all = (selector, root = document) => [...root.querySelectorAll(selector)];
  const byId = (id) => document.getElementById(id);
  const hidden = new Set();
  const tip = byId("tip");

  // --- which agents are shown

  for (const chip of all("#chips button")) {
    chip.addEventListener("click", () => {
      const series = Number(chip.dataset.chip);
      const isShown = hidden.delete(series) || !hidden.add(series);
      chip.setAttribute("aria-pressed", String(isShown));
      for (const element of all(`[data-s="${series}"]`)) element.toggleAttribute("hidden", !isShown);
      arrange();
    });
  }

  // --- the table: a head sorts the rows, a second click turns the order round

  for (const head of all("#headline th[data-key]")) {
    head.querySelector("button").addEventListener("click", () => {
      const before = head.getAttribute("aria-sort");
      const up = before ? before === "descending" : head.dataset.up === "1";
      for (const other of all("#headline th[aria-sort]")) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const value = (row) => row.cells[head.cellIndex].dataset.v;
      const rows = all("#headline tbody tr");
      rows.sort((a, b) => {
        if (value(a) === "" || value(b) === "") return (value(a) === "") - (value(b) === "");
        return (up ? 1 : -1) * (value(a) - value(b));
      });
      rows[0].parentNode.append(...rows);
    });
  }

  // --- the gallery: the worst card first, by a measure, of one agent or of all that are shown

  const cards = new Map(all("#gallery .card").map((card) => [Number(card.dataset.i), card]));
  const LAST = Infinity;

  function badness(card) {
    const measure = byId("measure").value, whose = byId("whose").value;
    const shown = whose === "" ? data.labels.keys() : [Number(whose)];
    const values = [...shown].filter((k) => whose !== "" || !hidden.has(k)).map((k) => {
      if (measure === "sm") return card.sm[k];
      if (measure === "all") return card.all[k];
      return card.all[k] === null || card.all[data.baseline] === null ? null : card.all[k] - card.all[data.baseline];
    });
    const known = values.filter((value) => value !== null);
    if (known.length) return known.reduce((a, b) => a + b) / known.length;
    return whose !== "" && card.failed[Number(whose)] ? -LAST : LAST;
  }

  function arrange() {
    const wanted = byId("find").value.trim().toLowerCase();
    const places = data.cards.map((_, i) => i);
    const bad = data.cards.map(badness);
    if (byId("measure").value === "name") places.sort((a, b) => data.cards[a].name.localeCompare(data.cards[b].name));
    else places.sort((a, b) => (bad[a] === bad[b] ? a - b : bad[a] - bad[b]));
    let count = 0;
    for (const i of places) {
      const isFound = data.cards[i].name.toLowerCase().includes(wanted);
      cards.get(i).toggleAttribute("hidden", !isFound);
      count += isFound;
    }
    byId("gallery").append(...places.map((i) => cards.get(i)));
    byId("count").textContent = `${count} of ${data.cards.length}`;
  }

  for (const id of ["measure", "whose", "find"]) byId(id).addEventListener("input", arrange);
  byId("controls").addEventListener("submit", (event) => event.preventDefault());
  arrange();

  // --- what lies under the pointer

  function show(text, event) {
    tip.textContent = text;
    tip.hidden = false;
    const room = 14, box = tip.getBoundingClientRect();
    const left = event.clientX + room + box.width > innerWidth ? event.clientX - room - box.width : event.clientX + room;
    const top = event.clientY + room + box.height > innerHeight ? event.clientY - room - box.height : event.clientY + room;
    tip.style.transform = `translate(${Math.max(4, left)}px, ${Math.max(4, top)}px)`;
  }

  for (const chart of all(".scatter")) {
    chart.addEventListener("pointermove", (event) => {
      const point = event.target.closest(".point");
      if (!point) return void (tip.hidden = true);
      const [x, y] = data.points[chart.dataset.value][all(".point", chart).indexOf(point)];
      const agent = data.labels[point.dataset.s], target = data.targets[point.dataset.t];
      show(`${target}\n${agent}\nr_sm ${y.toFixed(4)}, ${chart.dataset.value} ${x}`, event);
    });
  }

  for (const chart of all(".anytime")) {
    const { grid, means, box: [left, top, right, bottom], width } = data.curves[chart.dataset.work];
    const svg = chart.querySelector("svg"), cursor = chart.querySelector(".cursor");
    chart.addEventListener("pointermove", (event) => {
      const box = svg.getBoundingClientRect();
      const share = ((event.clientX - box.left) / box.width * width - left) / (right - left);
      if (share < 0 || share > 1) return;
      const k = Math.round(share * (grid.length - 1));
      const x = left + k / (grid.length - 1) * (right - left);
      cursor.setAttribute("d", `M${x} ${top}V${bottom}`);
      const lines = data.labels.map((label, i) => [label, means[i][k], i]);
      const known = lines.filter(([, mean, i]) => mean !== null && !hidden.has(i)).sort((a, b) => b[1] - a[1]);
      const head = `${Number(grid[k].toPrecision(3))} ${chart.dataset.work}`;
      show([head, ...known.map(([label, mean]) => `${mean.toFixed(1)}  ${label}`)].join("\n"), event);
    });
  }

  for (const chart of all(".scatter, .anytime")) {
    chart.addEventListener("pointerleave", () => {
      tip.hidden = true;
      chart.querySelector(".cursor")?.removeAttribute("d");
    });
  }
})();
