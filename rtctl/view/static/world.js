"use strict";

const KINDS = {
  free: [], wall: ["stiffness", "damping", "center"], spring: ["stiffness", "center"], detents: ["stiffness", "pitch"],
  damper: ["damping"], ball: ["center"], drag: ["center"],
};
const SLIDERS = {
  stiffness: { key: "stiffness_nm_rad", label: "stiffness", unit: "N m/rad", min: 1, max: 200, value: 20, log: true },
  damping: { key: "damping_nms_rad", label: "damping", unit: "N m s/rad", min: 0, max: 0.2, value: 0.02 },
  center: { key: "center_rad", label: "place", unit: "rad", min: -0.5, max: 0.5, value: 0 },
  pitch: { key: "pitch_rad", label: "pitch", unit: "rad", min: 0.05, max: 0.5, value: 0.2 },
};
let kind = "free", told = "", sending = false, again = false;
const chosen = Object.fromEntries(Object.values(SLIDERS).map((slider) => [slider.key, slider.value]));

// At most one request under way; the newest wish is sent when it is answered.
async function send() {
  if (sending) { again = true; return; }
  sending = true;
  const body = { kind };
  for (const name of KINDS[kind]) body[SLIDERS[name].key] = chosen[SLIDERS[name].key];
  await press("world", body);
  sending = false;
  if (again) { again = false; send(); }
}

function show(name) {
  kind = name;
  for (const button of $("kinds").children) button.setAttribute("aria-pressed", String(button.textContent === name));
  $("sliders").replaceChildren(...KINDS[name].map((part) => slider(SLIDERS[part])));
}

function choose(name) { show(name); send(); }

function slider(of) {
  const label = document.createElement("label"), input = document.createElement("input"), output = document.createElement("output");
  const value = (x) => of.log ? of.min * (of.max / of.min) ** x : of.min + (of.max - of.min) * x;
  const place = (v) => of.log ? Math.log(v / of.min) / Math.log(of.max / of.min) : (v - of.min) / (of.max - of.min);
  Object.assign(input, { type: "range", min: 0, max: 1, step: 0.005, value: place(chosen[of.key]) });
  const show = () => { output.textContent = `${chosen[of.key].toPrecision(3)} ${of.unit}`; };
  input.addEventListener("input", () => { chosen[of.key] = value(Number(input.value)); show(); send(); });
  show();
  label.append(of.label, input, output);
  return label;
}

for (const name of Object.keys(KINDS)) {
  const button = Object.assign(document.createElement("button"), { textContent: name });
  button.addEventListener("click", () => choose(name));
  $("kinds").append(button);
}
for (const button of document.querySelectorAll("[data-do]")) button.addEventListener("click", () => press(button.dataset.do));
$("operator").hidden = !operatorKey;
$("nokey").hidden = !!operatorKey;

let newest = {};
openStream([], { ticks: () => {}, event: () => {}, status: (status) => {
  newest = status;
  showHead(status);
  const now = status.world ? status.world.kind : "";
  if (now && now !== told && !sending) show(now);  // somebody chose it on another page
  told = now;
  if (status.position_rad) showFigures($("numbers"), jointFigures(status));
} });
(function frame() { requestAnimationFrame(frame); if (!document.hidden) drawScene($("scene"), newest); })();
