// The joint seen along its axis: link, virtual object, torque of the hand; its legend, and its numbers axis by axis.

import { DRAWINGS } from "./drawings.js";
import { element, redraw } from "./link.js";

/** A colour of view.css by its name, as it is in the light or in the dark. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

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
  const name = status.axes[axis] || "", y = height - 40, length = Math.min(cell * 0.46, y - 26);
  const at = (angle, r) => [x + r * Math.sin(angle), y - r * Math.cos(angle)];
  const line = (angle, r0, r1, wide, stroke, dash = []) => {
    draw.beginPath(); draw.setLineDash(dash); draw.lineWidth = wide; draw.strokeStyle = stroke; draw.lineCap = "round";
    draw.moveTo(...at(angle, r0)); draw.lineTo(...at(angle, r1)); draw.stroke(); draw.setLineDash([]);
  };
  drawDial(draw, at, line, length);
  const position = status.position_rad[axis], world = inForce(status).axis === name ? status.world : {};
  if (position == null) { label(draw, `${name}: no position`, x, height - 8); return; }
  if (status.environment[axis] !== "free" && status.proxy_rad[axis] != null) line(status.proxy_rad[axis], 0, length * 0.95, 4, colour("object"), [7, 7]);
  drawObject(draw, world, position, length, x, y, line);
  if (world.ball_rad != null) {
    const radius = length * 0.12, [bx, by] = at(world.ball_rad, length * 0.8);
    draw.beginPath(); draw.fillStyle = colour("ball");
    draw.arc(bx + Math.cos(world.ball_rad) * radius, by + Math.sin(world.ball_rad) * radius, radius, 0, 7); draw.fill();
  }
  line(position, 0, length, 9, colour("joint"));
  draw.beginPath(); draw.fillStyle = colour("ink"); draw.arc(x, y, 7, 0, 7); draw.fill();
  drawHand(draw, at(position, length), position, Math.max(-1, Math.min(1, status.hand_nm[axis] || 0)) * length * 0.8);
  label(draw, name, x, height - 8);
}

function drawDial(draw, at, line, length) {
  for (let tick = -8; tick <= 8; tick++) line(tick * 0.1, length * (tick % 5 ? 1.01 : 0.98), length * 1.05, 1, colour("ink-2"));
  for (const angle of [-0.5, 0, 0.5]) {
    const [tx, ty] = at(angle, length * 1.05 + 10);
    label(draw, angle ? String(angle).replace("-", "−") : "0 rad", tx, ty + 3);
  }
}

// An arrow at the tip, across the link: where the hand pushes, 1 N m at its longest.
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
function drawObject(draw, world, handle, length, x, y, line) {
  const centre = world.center_rad || 0, up = -Math.PI / 2;  // angles count from the vertical, to the right
  const sector = (from, to, fill) => {
    draw.globalAlpha = 0.25; draw.beginPath(); draw.fillStyle = colour(fill); draw.moveTo(x, y);
    draw.arc(x, y, length * 1.02, up + Math.min(from, to), up + Math.max(from, to)); draw.fill(); draw.globalAlpha = 1;
  };
  DRAWINGS[world.kind]?.paint?.({ draw, world, handle, length, x, y, centre, line, sector, colour });
}

/** What the picture's colours mean, those only that are in it now. */
export function showLegend(place, status) {
  const kind = inForce(status).kind;
  const entries = [["joint", "joint"], ["hand", "torque of the hand"]];
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
  const number = (value) => (value == null ? "–" : value.toFixed(3).replace("-", "−"));
  body.replaceChildren(...status.axes.map((name, k) => {
    const cells = [status.position_rad, status.velocity_rad_s, status.hand_nm, status.applied_nm].map((values) => element("td", { textContent: number(values[k]) }));
    return element("tr", {}, element("th", { scope: "row", textContent: name }), ...cells, element("td", { textContent: worldOf(status, k) }));
  }));
}

