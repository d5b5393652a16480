// Asking the server, and hearing from it. All addresses are relative: the token is in the page's own.

/** The answer to a request; what went wrong is an Error with the server's own words. */
export async function ask(path, options = {}) {
  let answer;
  try {
    answer = await fetch(path, options);
  } catch {
    throw new Error("The server does not answer: has it been ended?");
  }
  if (!answer.ok) throw new Error((await answer.text()).trim() || `The server says ${answer.status}.`);
  return answer;
}

export const post = (path, value) => ask(path, { method: "POST", body: JSON.stringify(value) });

/** Calls `post` with the newest value alone while an answer is waited for, so that a slider never gets ahead of it. */
export function newestOnly(send) {
  let waiting = null;
  async function offer(value) {
    if (offer.isBusy) { waiting = { value }; return; }
    offer.isBusy = true;
    try { await send(value); } finally { offer.isBusy = false; }
    if (waiting) { const next = waiting; waiting = null; await offer(next.value); }
  }
  return offer;
}

/** Hears of all pictures, and of the one that is looked at; silent while nobody sees the page. */
export class News {
  constructor(heard) {
    this.heard = heard;
    this.id = 0;
    document.addEventListener("visibilitychange", () => this.listen());
  }

  /** Listen to picture `id`, or go on listening. */
  listen(id = this.id) {
    this.id = id;
    this.source?.close();
    this.source = null;
    if (document.hidden) return;
    this.source = new EventSource(`events?id=${id}`);
    for (const kind of ["list", "crew", "item", "live"])
      this.source.addEventListener(kind, event => this.heard(kind, JSON.parse(event.data), id));
    this.source.addEventListener("error", () => this.heard("silence", null, id));
  }
}

const MOST_MB = 64; // of a file, as the server has it

/** Send a file; what it is the server finds out. */
export async function upload(file, waits) {
  if (file.size > MOST_MB * 1e6) throw new Error(`${file.name} has ${(file.size / 1e6).toFixed(0)} MB; at most ${MOST_MB} MB go in.`);
  const query = new URLSearchParams({ name: file.name || "pasted.png", waits: waits ? 1 : 0 });
  return (await ask(`pictures?${query}`, { method: "POST", body: file })).json();
}

/** Save what an address gives under the name that the server has for it. */
export async function save(path) {
  const answer = await ask(path), named = /filename\*=UTF-8''(\S+)/.exec(answer.headers.get("content-disposition") || "");
  const url = URL.createObjectURL(await answer.blob());
  const link = Drawing.make("a", { href: url, download: named ? decodeURIComponent(named[1]) : "file" });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(url), 10000);
}
