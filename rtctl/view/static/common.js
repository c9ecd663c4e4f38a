"use strict";
// What both pages share: the operator key, buttons, the stream, the drawing of the joint.

const $ = (id) => document.getElementById(id);

const operatorKey = (() => {
  const given = new URLSearchParams(location.hash.slice(1)).get("key");
  if (given) {
    sessionStorage.setItem("key", given);
    history.replaceState(null, "", location.pathname);
  }
  return sessionStorage.getItem("key") || "";
})();

function trouble(text) {
  $("trouble").textContent = text;
  $("trouble").hidden = !text;
}

let saidAt = 0;
async function press(name, body = {}) {
  try {
    const answer = await fetch("/do/" + name, {
      method: "POST",
      headers: { "Content-Type": "application/json", "X-Rtctl": "view", "X-Operator-Key": operatorKey },
      body: JSON.stringify(body),
    });
    const said = await answer.json();
    if (said.error) { trouble(said.error); saidAt = Date.now(); }
    return said;
  } catch (error) {
    trouble("the page's server does not answer: " + error.message);
    return {};
  }
}

// One EventSource at a time; it connects again by itself.
function openStream(signals, handlers) {
  const source = new EventSource("/stream?signals=" + encodeURIComponent(signals.join(",")));
  for (const [name, handle] of Object.entries(handlers)) {
    source.addEventListener(name, (message) => handle(JSON.parse(message.data)));
  }
  source.onerror = () => { trouble("the connection to the page's server is lost; trying again"); saidAt = Date.now(); };
  return source;
}

function showHead(status) {
  const badge = $("state");
  const state = status.silent ? "" : status.state || "";  // the last state is no state once nothing arrives
  badge.textContent = state || "no data";
  badge.className = "badge " + state;
  $("lease").textContent = (status.lease ? "a renderer holds the lease" : "") + (status.waiver ? "  without real-time rights" : "");
  const said = status.silent || (status.world && status.world.trouble) || "";
  if (said) { trouble(said); saidAt = Date.now(); }
  else if (Date.now() - saidAt > 5000) trouble("");
}

// Named figures, each kept together where the line breaks.
function showFigures(place, figures) {
  place.replaceChildren(...figures.map(([name, value]) => {
    const box = document.createElement("span");
    box.append(Object.assign(document.createElement("small"), { textContent: name }), value);
    return box;
  }));
}
function jointFigures(status) {
  const row = (values, unit) => values.map((v) => v == null ? "–" : v.toFixed(3)).join(", ") + " " + unit;
  return [["position", row(status.position_rad, "rad")], ["hand", row(status.hand_nm, "N m")], ["motor", row(status.applied_nm, "N m")]];
}

// The joint seen along its axis: link, virtual object, torque of the hand as an arc.
function drawScene(canvas, status) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth || 480, height = width * 220 / 480;
  if (canvas.width !== Math.round(width * ratio)) { canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); }
  const draw = canvas.getContext("2d");
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  draw.clearRect(0, 0, width, height);
  if (!status.position_rad) return;
  const axes = status.position_rad.length, cell = width / axes, ink = getComputedStyle(document.body).color;
  for (let axis = 0; axis < axes; axis++) {
    const x = cell * (axis + 0.5), y = height * 0.88, length = Math.min(cell * 0.42, height * 0.78);
    const at = (angle, r) => [x + r * Math.sin(angle), y - r * Math.cos(angle)];
    const line = (angle, r0, r1, wide, colour, dash = []) => {
      draw.beginPath(); draw.setLineDash(dash); draw.lineWidth = wide; draw.strokeStyle = colour; draw.lineCap = "round";
      draw.moveTo(...at(angle, r0)); draw.lineTo(...at(angle, r1)); draw.stroke(); draw.setLineDash([]);
    };
    draw.globalAlpha = 0.25;
    for (let tick = -8; tick <= 8; tick++) line(tick * 0.1, length * (tick % 5 ? 0.97 : 0.92), length, 1, ink);
    draw.globalAlpha = 1;
    if (status.environment && status.environment[axis] !== "free") line(status.proxy_rad[axis], 0, length * 0.95, 4, "#2563eb99", [6, 6]);
    if (axis === 0 && status.world) drawObject(draw, status.world, status.position_rad[0], length, x, y, line);
    const ball = status.world ? status.world.ball_rad : null;
    if (axis === 0 && ball !== null && ball !== undefined) {
      const radius = length * 0.12, [bx, by] = at(ball, length * 0.8), side = [Math.cos(ball), Math.sin(ball)];
      draw.beginPath(); draw.fillStyle = "#e07b00"; draw.arc(bx + side[0] * radius, by + side[1] * radius, radius, 0, 7); draw.fill();
    }
    line(status.position_rad[axis], 0, length, 9, "#2e7d32");
    draw.beginPath(); draw.fillStyle = ink; draw.arc(x, y, 7, 0, 7); draw.fill();
    const hand = Math.max(-1, Math.min(1, status.hand_nm[axis]));
    const [tx, ty] = at(status.position_rad[axis], length);
    draw.beginPath(); draw.strokeStyle = "#c62828"; draw.lineWidth = 3;
    draw.moveTo(tx, ty); draw.lineTo(tx + hand * length * 0.8 * Math.cos(status.position_rad[axis]), ty + hand * length * 0.8 * Math.sin(status.position_rad[axis])); draw.stroke();
  }
}

// What the world's thread has put on axis 0: wall, spring, detents or damper, where the law has them.
function drawObject(draw, world, handle, length, x, y, line) {
  const centre = world.center_rad || 0, up = -Math.PI / 2;  // angles count from the vertical, to the right
  if (world.kind === "wall") {
    const side = world.side < 0 ? -1 : 1;
    draw.beginPath(); draw.fillStyle = "#8d6e6355"; draw.moveTo(x, y);
    draw.arc(x, y, length * 1.02, up + centre, up + centre + side * 0.5, side < 0); draw.fill();
    line(centre, length * 0.15, length * 1.02, 4, "#6d4c41");
  } else if (world.kind === "spring") {
    const coils = 6, r = length * 0.6;
    draw.beginPath(); draw.strokeStyle = "#2563eb"; draw.lineWidth = 2;
    for (let k = 0; k <= 4 * coils; k++) {
      const angle = centre + (handle - centre) * k / (4 * coils), wave = [0, 1, 0, -1][k % 4] * length * 0.03;
      draw.lineTo(x + (r + wave) * Math.sin(angle), y - (r + wave) * Math.cos(angle));
    }
    draw.stroke();
    line(centre, length * 0.5, length * 0.7, 3, "#2563eb");
  } else if (world.kind === "detents" && world.pitch_rad > 0) {
    for (let k = Math.ceil((-1 - centre) / world.pitch_rad); centre + k * world.pitch_rad <= 1; k++) line(centre + k * world.pitch_rad, length * 0.86, length, 5, "#2563eb");
  } else if (world.kind === "damper") {
    draw.beginPath(); draw.fillStyle = "#2563eb22"; draw.moveTo(x, y); draw.arc(x, y, length * 1.02, up - 0.9, up + 0.9); draw.fill();
  }
}

$("stop").addEventListener("click", () => press("stop"));
document.addEventListener("keydown", (event) => { if (event.key === "Escape") press("stop"); });
