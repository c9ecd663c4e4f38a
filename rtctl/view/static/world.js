// The second page: a virtual world to feel, and its numbers.

import { $, Stream, element } from "./link.js";
import { lost, ordered, showHello, showStatus } from "./head.js";
import { drawScene, showAxes, showLegend } from "./scene.js";

const KINDS = {
  free: [], wall: ["stiffness", "damping", "center"], spring: ["stiffness", "center"], detents: ["stiffness", "pitch"],
  damper: ["damping"], ball: ["center"], drag: ["center"],
};
const MEANINGS = {
  free: "Free space: nothing but what is left of the friction.",
  wall: "A wall: stiff from its place on, towards larger angles.",
  spring: "A spring that pulls to its place.",
  detents: "Detents: the joint snaps from one to the next.",
  damper: "A damper: resists speed.",
  ball: "A ball to push: it rolls away, and comes to rest.",
  drag: "A proxy that follows the slider and pulls the joint along.",
};
const SLIDERS = {
  stiffness: { key: "stiffness_nm_rad", label: "stiffness", unit: "N m/rad", min: 1, max: 200, value: 20, log: true },
  damping: { key: "damping_nms_rad", label: "damping", unit: "N m s/rad", min: 0, max: 0.2, value: 0.02 },
  center: { key: "center_rad", label: "place", unit: "rad", min: -0.5, max: 0.5, value: 0 },
  pitch: { key: "pitch_rad", label: "pitch", unit: "rad", min: 0.05, max: 0.5, value: 0.2 },
};
const STEPS = 200;
const TOLD = { center_rad: ["wall", "spring", "detents"], pitch_rad: ["detents"] };  // what another page has chosen shows here, too
const chosen = Object.fromEntries(Object.values(SLIDERS).map((slider) => [slider.key, slider.value]));
let kind = "", told = "", sending = false, again = false, axes = [];

// At most one request under way; the newest wish is sent when it is answered.
async function send() {
  if (sending) { again = true; return; }
  sending = true;
  const body = { kind };
  for (const name of KINDS[kind]) body[SLIDERS[name].key] = chosen[SLIDERS[name].key];
  await ordered("world", body);
  sending = false;
  if (again) { again = false; send(); }
}

function show(name) {
  kind = name;
  for (const button of $("kinds").children) button.setAttribute("aria-pressed", String(button.textContent === name));
  $("meaning").textContent = MEANINGS[name] || "Choose one.";
  $("sliders").replaceChildren(...KINDS[name].map((part) => slider(SLIDERS[part])));
}

function slider(of) {
  const input = element("input", { type: "range", min: 0, max: STEPS, step: 1 }), output = element("output");
  const value = (x) => (of.log ? of.min * (of.max / of.min) ** x : of.min + (of.max - of.min) * x);
  const place = (v) => (of.log ? Math.log(v / of.min) / Math.log(of.max / of.min) : (v - of.min) / (of.max - of.min));
  const tell = () => {
    output.textContent = `${chosen[of.key].toPrecision(3)} ${of.unit}`;
    input.setAttribute("aria-valuetext", output.textContent);
  };
  input.value = Math.round(place(chosen[of.key]) * STEPS);
  input.addEventListener("input", () => { chosen[of.key] = value(Number(input.value) / STEPS); tell(); send(); });
  tell();
  return element("label", {}, of.label, input, output);
}

for (const name of Object.keys(KINDS)) {
  const button = element("button", { textContent: name, type: "button" });
  button.setAttribute("aria-pressed", "false");
  button.addEventListener("click", () => { show(name); send(); });
  $("kinds").append(button);
}
$("world").hidden = !$("nokey").hidden;

new Stream(() => [], {
  hello(hello) {
    showHello(hello);
    axes = hello.axes.map((axis) => axis.name);
    for (const of of Object.values(SLIDERS)) {
      const [low, high] = (hello.axes[0].bounds || {})[of.key] || [-Infinity, Infinity];
      of.min = Math.max(of.min, low); of.max = Math.min(of.max, high);
    }
    $("axis").textContent = axes.length > 1 ? `Acts on axis ${axes[0]}, the first of ${axes.length}.` : `Acts on axis ${axes[0]}.`;
  },
  ticks() {},
  event() {},
  lost,
  status(status) {
    showStatus(status);
    status.axes = axes;
    const now = status.world.kind;
    if (now && now !== told && now !== kind && !sending) {
      for (const [key, kinds] of Object.entries(TOLD)) if (kinds.includes(now) && status.world[key] != null) chosen[key] = status.world[key];
      show(now);
    }
    told = now;
    if (!status.position_rad) return;
    drawScene($("scene"), status);
    showLegend($("legend"), status);
    showAxes($("axes").tBodies[0], status);
  },
});
