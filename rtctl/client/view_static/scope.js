// The scope: which signals are shown, what has come of them, the time they share; kept in the browser for this rig.

import { $, element } from "./link.js";
import { CURVES, makePlot, tidy, valueText } from "./plot.js";

const KEEP_S = 65, HOLD_S = 600, LEAST_S = 0.02, GAP_S = 0.5, MOST = 16, STEP = 0.2;
const START = ["state.0", "position_rad.0", "hand_torque_nm.0", "torque_applied_nm.0"];

export const data = { t: [] };
export let scopes = [];
export const view = { follow: true, from: 0, to: 10 };

let began = 0, known = new Map(), changed = () => {}, cursor = null, kept = "", drawn = false, dirty = true;

/** Names of all signals that the page needs now: those of the scope, and those of the x-y plot. */
export const wanted = (more = []) => [...new Set([...scopes.map((scope) => scope.name), ...more])].slice(0, MOST);
export const info = (name) => known.get(name);
export const title = (one) => `${one.field}${one.part ? " · " + one.part : ""}`;

export function take(columns, more = []) {
  const times = data.t, last = times.length ? times[times.length - 1] : null;
  if (last !== null && columns.t[0] - began < last) for (const name of Object.keys(data)) data[name].length = 0;  // another run of the daemon
  if (!times.length) began = columns.t[0];
  const gap = times.length && columns.t[0] - began > last + GAP_S ? [last + 1e-6] : [];
  const add = [...gap, ...columns.t.map((t) => t - began)], before = times.length;
  times.push(...add);
  for (const name of wanted(more)) {
    const values = (data[name] ||= new Array(before).fill(null));
    values.push(...gap.map(() => null), ...(columns[name] || new Array(columns.t.length).fill(null)));
  }
  for (const name of Object.keys(data)) if (data[name].length < times.length) delete data[name];  // no longer sent
  const from = after(times[times.length - 1] - (view.follow ? KEEP_S : HOLD_S));
  if (from > 500) for (const name of Object.keys(data)) data[name].splice(0, from);
  dirty = true;
}

/** Begin with what this rig offers: the signals of last time, else those to start with. `onChange` hears of others. */
export function begin(hello, onChange) {
  changed = onChange;
  known = new Map(hello.signals.map((one) => [one.name, one]));
  kept = "rtctl.scope." + hello.rig;
  const saved = read();
  for (const [writer, label] of [["backend", "measured"], ["law", "law and state"], ["loop", "loop"]]) {
    const group = element("optgroup", { label });
    for (const one of hello.signals.filter((signal) => signal.writer === writer)) {
      group.append(element("option", { value: one.name, textContent: title(one) + (one.unit ? ` [${one.unit}]` : ""), title: one.meaning }));
    }
    $("add").append(group);
  }
  if ([...$("window").options].some((option) => option.value === saved.window)) $("window").value = saved.window;
  (Array.isArray(saved.signals) ? saved.signals : START).filter((name) => known.has(name)).slice(0, MOST).forEach((name) => add(name));
  requestAnimationFrame(frame);
  return saved;
}

function read() {
  try { return JSON.parse(localStorage.getItem(kept)) || {}; } catch { return {}; }
}

/** Keep what is shown for the next time; `more` beside what was kept. */
export function keep(more = {}) {
  try {
    localStorage.setItem(kept, JSON.stringify({ ...read(), signals: scopes.map((scope) => scope.name), window: $("window").value, ...more }));
  } catch { /* a browser that keeps nothing */ }
}

function add(name) {
  const one = known.get(name), used = scopes.map((scope) => scope.slot);
  const slot = [...Array(MOST).keys()].find((k) => !used.includes(k));
  const now = element("output"), remove = element("button", { className: "remove", textContent: "×", title: "Remove" });
  remove.setAttribute("aria-label", `Remove ${title(one)}`);
  const swatch = element("i", { className: "swatch" });
  swatch.style.background = `var(--curve-${slot % CURVES})`;
  const head = element("h3", { title: one.meaning }, swatch, title(one), now, remove);
  const box = element("div", { className: "scope" }, head);
  const scope = { name, one, slot, box, now, plot: null };
  remove.addEventListener("click", () => {
    const next = box.nextElementSibling || box.previousElementSibling;
    scope.plot.destroy(); box.remove();
    scopes = scopes.filter((other) => other !== scope);
    ((next && next.querySelector("button")) || $("add")).focus();
    arranged();
  });
  $("scopes").append(box);
  scopes.push(scope);
}

function arranged() { rebuild(); keep(); changed(); }

/** Make all plots anew: after a change of their number, and of light to dark. */
export function rebuild() {
  scopes.forEach((scope, k) => {
    if (scope.plot) scope.plot.destroy();
    scope.plot = makePlot(scope.box, scope.one, scope.slot, k === scopes.length - 1, { zoomed, over: (index) => { if (cursor !== index) { cursor = index; dirty = true; } } });
  });
  dirty = true;
}

function zoomed(from, to) { view.from = Math.max(0, from); view.to = to; hold(true); }

/** Hold the picture while the data go on, or follow the newest again. */
function hold(still) {
  view.follow = !still;
  dirty = true;
  $("pause").setAttribute("aria-pressed", String(still));
  $("pause").textContent = still ? "Go on" : "Pause";
}
export const follow = () => hold(false);

function end() { return data.t.length ? data.t[data.t.length - 1] : 0; }

/** Move by a part of what is shown, or show more or less time around its middle; not beyond the data. */
function shift(factor, by) {
  const span = Math.min(Math.max((view.to - view.from) * factor, LEAST_S), HOLD_S);
  const to = (view.from + view.to) / 2 + by * span + span / 2;
  view.to = Math.min(Math.max(to, Math.min(span, end())), end());
  view.from = view.to - span;
  hold(true);
}

/** Index of the first time at or after `t`. */
function after(t) {
  let low = 0, high = data.t.length;
  while (low < high) { const middle = (low + high) >> 1; if (data.t[middle] < t) low = middle + 1; else high = middle; }
  return low;
}

/** Where what is in view begins, and where it has ended. */
export const inView = () => [after(view.from), after(view.to + 1e-9)];

function frame() {
  requestAnimationFrame(frame);
  if (!scopes.every((scope) => scope.plot)) rebuild();
  if (document.hidden) return;
  for (const scope of scopes) if (scope.box.clientWidth && scope.box.clientWidth !== scope.plot.width) { scope.plot.setSize({ width: scope.box.clientWidth, height: scope.plot.height }); dirty = true; }
  if (!dirty || !data.t.length) return;
  dirty = false;
  if (view.follow) { view.to = end(); view.from = view.to - Number($("window").value); }
  const [first, past] = inView(), from = Math.max(0, first - 1), to = past + 1;
  const times = data.t.slice(from, to);
  for (const scope of scopes) {
    const values = (data[scope.name] || []).slice(from, to);
    scope.plot.batch(() => {
      scope.plot.setData([times, values.length === times.length ? values : times.map(() => null)], false);
      scope.plot.setScale("x", { min: view.from, max: view.to });
    });
    const at = cursor !== null && cursor < values.length ? cursor : values.length - 1;
    scope.now.textContent = valueText(scope.one, values[at]) + (cursor !== null && at === cursor ? ` at ${tidy(times[at], 0.001)} s` : "");
  }
  if (!drawn) { drawn = true; requestAnimationFrame(() => performance.mark("first data drawn")); }
}

const KEYS = {
  ArrowLeft: () => shift(1, -STEP), ArrowRight: () => shift(1, STEP),
  "+": () => shift(1 / 1.5, 0), "-": () => shift(1.5, 0), End: follow,
};
if ($("scopes")) {
  $("scopes").addEventListener("keydown", (event) => {
    if (event.target !== $("scopes") || !KEYS[event.key]) return;
    event.preventDefault();
    KEYS[event.key]();
  });
  $("scopes").addEventListener("dblclick", follow);
  $("pause").addEventListener("click", () => hold(view.follow));
  $("window").addEventListener("change", () => { follow(); keep(); });
  $("add").addEventListener("change", () => {
    const name = $("add").value;
    $("add").value = "";
    if (known.has(name) && !scopes.some((scope) => scope.name === name) && scopes.length < MOST) { add(name); arranged(); }
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", rebuild);
}
