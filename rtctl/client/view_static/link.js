// The page's server: operator key, buttons, the stream of what the rig does. All text is set as text, never as HTML.

export const $ = (id) => document.getElementById(id);

export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** Replace the children of `place` only where `key` is another: what is read aloud or selected stays in peace. */
export function redraw(place, key, make) {
  const text = JSON.stringify(key);
  if (place.drawnFrom === text) return;
  place.drawnFrom = text;
  place.replaceChildren(...make());
}

export const operatorKey = (() => {
  const given = new URLSearchParams(location.hash.slice(1)).get("key");
  if (given) {
    sessionStorage.setItem("key", given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("key") || "";
})();

const HEADERS = { "X-Rtctl": "view" };  // no foreign page, nor an image in it, can send this
const ANSWER_MS = 4000;
export const AGAIN_MS = 1000;

/** Press a button. Gives `{ok, result}` or `{error}`, and never throws. */
export async function press(name, body = {}) {
  try {
    const answer = await fetch("/do/" + name, {
      method: "POST",
      headers: { ...HEADERS, "Content-Type": "application/json", "X-Operator-Key": operatorKey },
      body: JSON.stringify(body),
      signal: AbortSignal.timeout(ANSWER_MS),
    });
    return await answer.json();
  } catch (error) {
    return { error: "the page's server does not answer" };
  }
}

export async function ask(path, signal) {
  const answer = await fetch(path, { headers: HEADERS, signal, cache: "no-store" });
  if (!answer.ok) throw new Error((await answer.json()).error);
  return answer;
}

const PLACES = 4;
const FULL = "four windows of this browser look (or record) already: close one";

/**
 * Run `task` while one of the browser's few places is held: it has six connections for all its windows, and STOP needs one.
 * Throws where none is free. A browser that has no locks here (a page from another machine) is let in.
 */
export async function placed(task) {
  if (!navigator.locks) return task();
  for (let place = 0; place < PLACES; place++) {
    const done = await navigator.locks.request("rtctl " + place, { ifAvailable: true }, async (lock) => lock !== null && (await task(), true));
    if (done) return;
  }
  throw new Error(FULL);
}

/**
 * What the rig does, until the page is left: connects again by itself, and lets go while nobody sees the page.
 *
 * signals: function that gives the names of the curves wanted; handlers: by the names of events, besides `hello` and `lost`.
 */
export class Stream {
  constructor(signals, handlers) {
    this.signals = signals;
    this.handlers = handlers;
    this.life = null;
    document.addEventListener("visibilitychange", () => (document.hidden ? this.close() : this.open()));
    if (!document.hidden) this.open();
  }

  /** Begin anew, with the signals of now. */
  open() {
    this.close();
    this.life = new AbortController();
    this.run(this.life.signal);
  }

  close() { if (this.life) this.life.abort(); }

  async run(signal) {
    while (!signal.aborted) {
      try {
        await placed(() => this.look(signal));
      } catch (error) {
        if (signal.aborted) return;
        this.handlers.lost(error instanceof TypeError ? "the page's server does not answer" : error.message);
      }
      await new Promise((done) => setTimeout(done, AGAIN_MS));
    }
  }

  async look(signal) {
    this.handlers.hello(await (await ask("/hello", signal)).json());
    const answer = await ask("/stream?signals=" + encodeURIComponent(this.signals().join(",")), signal);
    const reader = answer.body.pipeThrough(new TextDecoderStream()).getReader();
    for (let pending = ""; ;) {
      const { value, done } = await reader.read();
      if (done) throw new Error("the page's server has ended");
      const messages = (pending + value).split("\n\n");
      pending = messages.pop();
      for (const message of messages) {
        const [event, data] = message.split("\n");
        this.handlers[event.slice("event: ".length)](JSON.parse(data.slice("data: ".length)));
      }
    }
  }
}
