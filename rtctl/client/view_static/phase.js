// The x-y plot: one signal over another, for the time that the scope shows. Hysteresis, walls and friction are seen here.

import { $, element } from "./link.js";
import { tidy } from "./plot.js";
import { colour } from "./scene.js";
import { data, info, inView, keep, title } from "./scope.js";

const LEFT = 78, FOOT = 46, TOP = 10, RIGHT = 16;
const START = { x: "velocity_rad_s.0", y: "hand_torque_nm.0" };

/** The signals it needs; none while it is folded. */
export const phaseSignals = () => ($("phase").open ? [$("phase-x").value, $("phase-y").value].filter(Boolean) : []);

export function beginPhase(hello, saved, changed) {
  const chosen = saved.phase || {};
  for (const axis of ["x", "y"]) {
    const select = $("phase-" + axis);
    select.append(...hello.signals.map((one) => element("option", { value: one.name, textContent: title(one) + (one.unit ? ` [${one.unit}]` : "") })));
    select.value = info(chosen[axis]) ? chosen[axis] : START[axis];
    select.addEventListener("change", told);
  }
  $("phase").open = chosen.open === true;
  $("phase").addEventListener("toggle", told);
  requestAnimationFrame(frame);

  function told() {
    keep({ phase: { open: $("phase").open, x: $("phase-x").value, y: $("phase-y").value } });
    changed();
  }
}

function frame() {
  requestAnimationFrame(frame);
  if ($("phase").open && !document.hidden) drawPhase($("phase-plot"), info($("phase-x").value), info($("phase-y").value));
}

function drawPhase(canvas, x, y) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !x || !y) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) { canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); }
  const [first, past] = inView(), points = [];
  const xs = data[x.name] || [], ys = data[y.name] || [];
  for (let k = first; k < past; k++) points.push(xs[k] == null || ys[k] == null ? null : [xs[k], ys[k]]);
  const draw = canvas.getContext("2d");
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw.clearRect(0, 0, width, height);
  const across = scale(points.map((p) => p && p[0]), LEFT, width - RIGHT), upward = scale(points.map((p) => p && p[1]), height - FOOT, TOP);
  drawGrid(draw, across, upward, width, height, x, y);
  draw.beginPath(); draw.strokeStyle = colour("curve-0"); draw.lineWidth = 1.5; draw.lineJoin = "round";
  let down = false;
  for (const point of points) {
    if (point) { const at = [across.at(point[0]), upward.at(point[1])]; if (down) draw.lineTo(...at); else draw.moveTo(...at); }
    down = !!point;
  }
  draw.stroke();
  const last = points[points.length - 1];
  if (last) { draw.beginPath(); draw.fillStyle = colour("hand"); draw.arc(across.at(last[0]), upward.at(last[1]), 4, 0, 7); draw.fill(); }
}

/** From values to pixels, with ticks at round numbers. */
function scale(values, from, to) {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v != null) { low = Math.min(low, v); high = Math.max(high, v); }
  if (low > high) [low, high] = [-1, 1];
  const more = (high - low) * 0.06 || Math.max(Math.abs(high) * 0.05, 1e-3);
  low -= more; high += more;
  const rough = (high - low) / Math.max(2, Math.abs(to - from) / 64), power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((k) => k * power).find((s) => s >= rough);
  const ticks = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) ticks.push(k * step);
  return { at: (v) => from + (v - low) / (high - low) * (to - from), ticks, step };
}

function drawGrid(draw, across, upward, width, height, x, y) {
  const name = (one) => title(one) + (one.unit ? ` [${one.unit}]` : "");
  draw.font = "12px system-ui, sans-serif"; draw.lineWidth = 1; draw.strokeStyle = colour("grid"); draw.fillStyle = colour("ink-2");
  draw.beginPath(); draw.textAlign = "center";
  for (const v of across.ticks) { const at = across.at(v); draw.moveTo(at, TOP); draw.lineTo(at, height - FOOT); draw.fillText(tidy(v, across.step), at, height - FOOT + 16); }
  draw.fillText(name(x), (LEFT + width) / 2, height - 8);
  draw.textAlign = "right";
  for (const v of upward.ticks) { const at = upward.at(v); draw.moveTo(LEFT, at); draw.lineTo(width - RIGHT, at); draw.fillText(tidy(v, upward.step), LEFT - 8, at + 4); }
  draw.stroke();
  draw.save(); draw.translate(14, (height - FOOT) / 2); draw.rotate(-Math.PI / 2); draw.textAlign = "center"; draw.fillText(name(y), 0, 0); draw.restore();
}
