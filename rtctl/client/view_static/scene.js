// The joint seen along its axis, or the carriage on its rail: virtual object, torque or force of the hand; legend, and numbers axis by axis.

import { DRAWINGS } from "./drawings.js";
import { element, redraw } from "./link.js";

/** A colour of view.css by its name, as it is in the light or in the dark. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

const UNITS = { rotary: ["rad", "rad/s", "N m", "N m"], linear: ["m", "m/s", "N", "N"] };
const RAIL_M = 1, strongest = {};  // half a rail without ends; the largest force of a hand so far, by axis

/** What the pages need of each axis beside its name: motion, and the ends of its travel. */
export const axisFacts = (hello) => hello.axes.map((axis) => ({ name: axis.name, motion: axis.motion || "rotary", travel: (axis.bounds || {}).position_rad || [] }));

const LAW = { ball: "wall", drag: "remote" };  // the environment that the law has for it

/** The world of the page's server where it is what the law renders now; else nothing: another program has changed it. */
function inForce(status) {
  const world = status.world || {}, axis = status.axes.indexOf(world.axis);
  return axis >= 0 && status.environment[axis] === (LAW[world.kind] || world.kind) ? world : {};
}

export function drawScene(canvas, status) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  }
  const draw = canvas.getContext("2d");
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw.clearRect(0, 0, width, height);
  if (!status.position_rad) return;
  const cell = width / status.position_rad.length;
  status.position_rad.forEach((position, axis) => drawJoint(draw, status, axis, cell * (axis + 0.5), cell, height));
}

function drawJoint(draw, status, axis, x, cell, height) {
  const name = status.axes[axis] || "", slides = (status.facts[axis] || {}).motion === "linear";
  const y = height - (slides ? 56 : 40), length = Math.min(cell * 0.46, y - 26) * (slides ? 0.6 : 1);
  const [low, high] = slides ? railOf(status.facts[axis]) : [-1, 1];
  const at = slides
    ? (place, r) => [x + cell * 0.42 * (2 * (place - low) / (high - low) - 1), y - r]
    : (angle, r) => [x + r * Math.sin(angle), y - r * Math.cos(angle)];
  const line = (angle, r0, r1, wide, stroke, dash = []) => {
    draw.beginPath(); draw.setLineDash(dash); draw.lineWidth = wide; draw.strokeStyle = stroke; draw.lineCap = "round";
    draw.moveTo(...at(angle, r0)); draw.lineTo(...at(angle, r1)); draw.stroke(); draw.setLineDash([]);
  };
  if (slides) drawRail(draw, at, low, high); else drawDial(draw, at, line, length);
  const position = status.position_rad[axis], world = inForce(status).axis === name ? status.world : {};
  if (position == null) { label(draw, `${name}: no position`, x, height - 8); return; }
  if (status.environment[axis] !== "free" && status.proxy_rad[axis] != null) line(status.proxy_rad[axis], 0, length * 0.95, 4, colour("object"), [7, 7]);
  drawObject(draw, world, position, { length, x, y, line, at, low, high, slides });
  if (world.ball_rad != null) {
    const radius = length * 0.12, [bx, by] = at(world.ball_rad, length * (slides ? 0.12 : 0.8)), turned = slides ? 0 : world.ball_rad;
    draw.beginPath(); draw.fillStyle = colour("ball");
    draw.arc(bx + Math.cos(turned) * radius, by + Math.sin(turned) * radius, radius, 0, 7); draw.fill();
  }
  const hand = status.hand_nm[axis] || 0;
  if (slides) {
    const [cx, cy] = at(position, 0);
    draw.fillStyle = colour("joint"); draw.fillRect(cx - 16, cy - 24, 32, 22);
    strongest[name] = Math.max(strongest[name] || 1, Math.abs(hand));
    drawHand(draw, [cx, cy - 13], 0, (hand / strongest[name]) * length * 0.8);
  } else {
    line(position, 0, length, 9, colour("joint"));
    draw.beginPath(); draw.fillStyle = colour("ink"); draw.arc(x, y, 7, 0, 7); draw.fill();
    drawHand(draw, at(position, length), position, Math.max(-1, Math.min(1, hand)) * length * 0.8);
  }
  label(draw, name, x, height - 8);
}

function railOf({ travel: [low, high] }) {
  return high > low && high - low < 100 ? [low, high] : [-RAIL_M, RAIL_M];
}

function drawRail(draw, at, low, high) {
  draw.beginPath(); draw.lineWidth = 2; draw.strokeStyle = colour("ink-2");
  draw.moveTo(...at(low, 0)); draw.lineTo(...at(high, 0));
  for (let k = 0; k <= 8; k++) {
    const place = low + (high - low) * k / 8, deep = k % 4 ? 4 : 9;
    draw.moveTo(...at(place, 0)); draw.lineTo(...at(place, -deep));
    if (k % 4 === 0) label(draw, `${String(Number(place.toPrecision(3))).replace("-", "−")} m`, at(place, 0)[0], at(place, 0)[1] + 22);
  }
  draw.stroke();
}

function drawDial(draw, at, line, length) {
  for (let tick = -8; tick <= 8; tick++) line(tick * 0.1, length * (tick % 5 ? 1.01 : 0.98), length * 1.05, 1, colour("ink-2"));
  for (const angle of [-0.5, 0, 0.5]) {
    const [tx, ty] = at(angle, length * 1.05 + 10);
    label(draw, angle ? String(angle).replace("-", "−") : "0 rad", tx, ty + 3);
  }
}

// An arrow at the tip, across the link: where the hand pushes, 1 N m at its longest; of a carriage its largest force so far.
function drawHand(draw, [tx, ty], angle, size) {
  if (Math.abs(size) < 2) return;
  const [ux, uy] = [Math.cos(angle), Math.sin(angle)], [ex, ey] = [tx + size * ux, ty + size * uy], head = Math.sign(size) * Math.min(8, Math.abs(size));
  draw.beginPath(); draw.strokeStyle = colour("hand"); draw.lineWidth = 3;
  draw.moveTo(tx, ty); draw.lineTo(ex, ey);
  draw.moveTo(ex - head * ux - head * 0.6 * uy, ey - head * uy + head * 0.6 * ux); draw.lineTo(ex, ey);
  draw.lineTo(ex - head * ux + head * 0.6 * uy, ey - head * uy - head * 0.6 * ux); draw.stroke();
}

function label(draw, text, x, y) {
  draw.font = "12px system-ui, sans-serif"; draw.textAlign = "center"; draw.fillStyle = colour("ink-2");
  draw.fillText(text, x, y);
}

// What the world's thread has put on its axis, where the law has it.
function drawObject(draw, world, handle, frame) {
  const { length, x, y, at, low, high, slides } = frame;
  const centre = world.center_rad || 0, up = -Math.PI / 2;  // angles count from the vertical, to the right
  const sector = (from, to, fill) => {
    draw.globalAlpha = 0.25; draw.beginPath(); draw.fillStyle = colour(fill);
    if (slides) {
      const inside = (place) => Math.min(Math.max(place, low), high), [left, top] = at(inside(Math.min(from, to)), length * 1.02);
      draw.fillRect(left, top, at(inside(Math.max(from, to)), 0)[0] - left, y - top); draw.globalAlpha = 1;
      return;
    }
    draw.moveTo(x, y);
    draw.arc(x, y, length * 1.02, up + Math.min(from, to), up + Math.max(from, to)); draw.fill(); draw.globalAlpha = 1;
  };
  DRAWINGS[world.kind]?.paint?.({ ...frame, draw, world, handle, centre, sector, colour, unit: slides ? (high - low) / 2 : 1 });
}

/** What the picture's colours mean, those only that are in it now. */
export function showLegend(place, status) {
  const kind = inForce(status).kind;
  const motions = new Set((status.facts || []).map((one) => one.motion)), slide = motions.has("linear"), turn = motions.has("rotary");
  const entries = [["joint", [turn && "joint", slide && "carriage"].filter(Boolean).join(" or ")], ["hand", `${[turn && "torque", slide && "force"].filter(Boolean).join(" or ")} of the hand`]];
  if ((status.environment || []).some((one) => one !== "free")) entries.push(["object", "virtual object (dashed)"]);
  if (DRAWINGS[kind]) entries.push([DRAWINGS[kind].colour, kind]);
  redraw(place, entries, () => entries.map(([name, text]) => element("li", {}, swatch(name), text)));
}

function swatch(name) {
  const made = element("i", { className: "swatch" });
  made.style.background = `var(--${name})`;
  return made;
}

/** The world of an axis, and the virtual mass it acts on. */
function worldOf(status, k) {
  const shown = (status.display || [])[k];
  if (!shown || shown.kind !== "admittance") return status.environment[k];
  const damped = shown.injected_nms_rad > 0 ? `, damped +${shown.injected_nms_rad.toFixed(1)}` : "";
  return `${status.environment[k]}, m ${shown.mass_kgm2.toPrecision(2)}${damped}`;  // kg m², as the sliders say
}

/** A row of numbers for each axis. */
export function showAxes(body, status) {
  const motionOf = (k) => (status.facts[k] || {}).motion || "rotary";
  const number = (value, k) => (value == null ? "–" : value.toFixed(motionOf(k) === "linear" ? 4 : 3).replace("-", "−"));
  const motions = [...new Set(status.axes.map((_, k) => motionOf(k)))];
  body.parentElement.tHead.querySelectorAll("small").forEach((unit, at) => {
    const said = [...new Set(motions.map((one) => UNITS[one][at]))].join(" | ");  // axes of both in one rig
    if (unit.textContent !== said) unit.textContent = said;
  });
  body.replaceChildren(...status.axes.map((name, k) => {
    const cells = [status.position_rad, status.velocity_rad_s, status.hand_nm, status.applied_nm].map((values) => element("td", { textContent: number(values[k], k) }));
    return element("tr", {}, element("th", { scope: "row", textContent: name }), ...cells, element("td", { textContent: worldOf(status, k) }));
  }));
}

