// The second page: a virtual world to feel, and its numbers.

import { $, Stream, element } from "./link.js";
import { lost, ordered, showHello, showStatus } from "./head.js";
import { axisFacts, drawScene, showAxes, showLegend } from "./scene.js";

const STEPS = 200;
let worlds = {}, sliders = {}, chosen = {};  // what /hello says that there is; what the sliders stand at
let kind = "", told = "", sending = false, again = false, axes = [], facts = [];

// At most one request under way; the newest wish is sent when it is answered.
async function send() {
  if (sending) { again = true; return; }
  sending = true;
  const body = { kind };
  for (const key of worlds[kind].numbers) body[key] = chosen[key];
  await ordered("world", body);
  sending = false;
  if (again) { again = false; send(); }
}

function show(name) {
  kind = name;
  for (const button of $("kinds").children) button.setAttribute("aria-pressed", String(button.textContent === name));
  $("meaning").textContent = worlds[name].meaning;
  $("sliders").replaceChildren(...worlds[name].numbers.map((key) => slider(key, sliders[key])));
}

function slider(key, of) {
  const input = element("input", { type: "range", min: 0, max: STEPS, step: 1 }), output = element("output");
  const value = (x) => (of.log ? of.low * (of.high / of.low) ** x : of.low + (of.high - of.low) * x);
  const place = (v) => (of.log ? Math.log(v / of.low) / Math.log(of.high / of.low) : (v - of.low) / (of.high - of.low));
  const tell = () => {
    output.textContent = `${Math.abs(chosen[key]) < 1000 ? chosen[key].toPrecision(3) : Math.round(chosen[key])} ${of.unit}`;
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.value = Math.round(place(chosen[key]) * STEPS);
  input.addEventListener("input", () => { chosen[key] = value(Number(input.value) / STEPS); tell(); send(); });
  tell();
  return element("label", {}, of.label, input, output);
}

function offer(hello) {
  ({ worlds, sliders } = hello);
  for (const [key, of] of Object.entries(sliders)) {
    const [low, high] = (hello.axes[0].bounds || {})[key] || [-Infinity, Infinity];
    of.low = Math.max(of.low, low); of.high = Math.min(of.high, high);
    chosen[key] ??= of.value;
  }
  $("kinds").replaceChildren(...Object.keys(worlds).map((name) => {
    const button = element("button", { textContent: name, type: "button" });
    button.setAttribute("aria-pressed", String(name === kind));
    button.addEventListener("click", () => { show(name); send(); });
    return button;
  }));
}

$("world").hidden = !$("nokey").hidden;

new Stream(() => [], {
  hello(hello) {
    showHello(hello);
    axes = hello.axes.map((axis) => axis.name); facts = axisFacts(hello);
    offer(hello);
    $("axis").textContent = axes.length > 1 ? `Acts on axis ${axes[0]}, the first of ${axes.length}.` : `Acts on axis ${axes[0]}.`;
  },
  ticks() {},
  event() {},
  lost,
  status(status) {
    showStatus(status);
    status.axes = axes; status.facts = facts;
    const now = status.world.kind;
    if (now && now !== told && now !== kind && !sending) {
      if (worlds[now].law) for (const key of worlds[now].numbers) if (status.world[key] != null) chosen[key] = status.world[key];  // what another page has chosen
      show(now);
    }
    told = now;
    if (!status.position_rad) return;
    drawScene($("scene"), status);
    showLegend($("legend"), status);
    showAxes($("axes").tBodies[0], status);
  },
});
