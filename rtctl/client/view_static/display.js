// What an axis shows: its virtual mass, and what the rig file lets a client change of it.

import { $, element, operatorKey } from "./link.js";
import { ordered } from "./head.js";

const STEPS = 200;
const NUMBERS = { rotary: [["mass_kgm2", "mass", "kg m²"], ["mass_damping_nms_rad", "damping", "N m s/rad"]], linear: [["mass_kgm2", "mass", "kg"], ["mass_damping_nms_rad", "damping", "N s/m"]] };
let controls = [];

function slider(axis, [key, name, unit], [low, high]) {
  const input = element("input", { type: "range", min: "0", max: String(STEPS), step: "1" });
  const output = element("output", { textContent: "–" });
  const at = () => low * (high / low) ** (input.value / STEPS);  // equal ways, equal ratios
  const say = (value) => { output.textContent = `${value.toPrecision(2)} ${unit}`; };
  const one = { axis, key, held: false, show(value) {
    if (one.held || !value) return;
    input.value = STEPS * Math.log(value / low) / Math.log(high / low);
    say(value);
  } };
  input.addEventListener("input", () => { one.held = true; say(at()); });
  input.addEventListener("change", async () => {
    await ordered("display", { axis, [key]: Math.min(Math.max(at(), low), high) });
    setTimeout(() => { one.held = false; }, 500);  // until what is in force has come back
  });
  return [one, element("label", { className: "slide" }, element("span", { textContent: `${name} of ${axis}` }), input, output)];
}

function chooser(axis, displays) {
  const select = element("select", {}, ...displays.map((name) => element("option", { value: name, textContent: name })));
  const one = { axis, key: "kind", show(kind) { if (document.activeElement !== select) select.value = kind; } };
  select.addEventListener("change", async () => { await ordered("display", { axis, display: select.value }); select.blur(); });
  return [one, element("label", { className: "slide" }, element("span", { textContent: `display of ${axis}` }), select)];
}

export function beginDisplay(hello) {
  controls = [];
  const rows = [];
  const add = ([one, label]) => { controls.push(one); rows.push(label); };
  for (const axis of operatorKey ? hello.axes : []) {
    const displays = axis.displays || [];
    if (displays.length > 1) add(chooser(axis.name, displays));
    if (!displays.includes("admittance")) continue;
    for (const number of NUMBERS[axis.motion || "rotary"]) {
      const [low, high] = axis.bounds[number[0]];
      if (high > low && low > 0) add(slider(axis.name, number, [low, high]));
    }
  }
  $("displays").replaceChildren(...rows);
}

export function showDisplay(status) {
  for (const one of controls) {
    const display = status.display[status.axes.indexOf(one.axis)];
    one.show(display[one.key]);
  }
}
