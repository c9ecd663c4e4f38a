"use strict";

const KEEP_S = 60;
const COLOURS = ["#2563eb", "#c62828", "#2e7d32", "#b26a00", "#7b1fa2", "#00838f"];
const START = ["position_rad.0", "hand_torque_nm.0", "torque_applied_nm.0"];

let began = 0, known = {}, scopes = [], source = null, paused = false, follow = true, drawn = false;
const data = { t: [] };

function shown() { return [...new Set(scopes.map((scope) => scope.name))]; }

function connect() {
  if (source) source.close();
  source = openStream(shown(), { ticks: take, status: showStatus, event: showEvent });
}

function forget() { for (const name of Object.keys(data)) data[name].length = 0; }

function take(columns) {
  if (data.t.length && columns.t[0] - began < data.t[data.t.length - 1]) forget();  // another run of the daemon
  if (!data.t.length) began = columns.t[0];
  data.t.push(...columns.t.map((t) => t - began));
  for (const name of shown()) {
    const values = (data[name] ||= new Array(data.t.length - columns.t.length).fill(null));
    values.push(...(columns[name] || new Array(columns.t.length).fill(null)));
  }
  const from = data.t.findIndex((t) => t > data.t[data.t.length - 1] - KEEP_S);
  if (from > 500) for (const name of Object.keys(data)) data[name].splice(0, from);
}

function addScope(name, keep = true) {
  const info = known[name] || { label: name, unit: "" };
  const box = document.createElement("div");
  box.className = "scope";
  const remove = document.createElement("button");
  remove.className = "remove"; remove.textContent = "×"; remove.title = "remove " + info.label;
  const title = Object.assign(document.createElement("h3"), { textContent: `${info.label} [${info.unit}]`, title: info.meaning || "" });
  box.append(remove, title);
  $("scopes").append(box);
  const colour = COLOURS[scopes.length % COLOURS.length];
  const plot = new uPlot({
    width: box.clientWidth || 600, height: 150,
    cursor: { sync: { key: "rtctl" } },
    legend: { show: false },
    scales: { x: { time: false } },
    axes: [
      { stroke: "#888", space: 60, size: 26, values: (_, ticks) => ticks.map((t) => t < 0 ? "" : t.toPrecision(12) / 1 + " s") },
      { stroke: colour, size: 64, space: 24 },
    ],
    series: [{ label: "s" }, { label: `${info.label} [${info.unit}]`, stroke: colour, width: 1.5, spanGaps: false, value: (_, v) => v == null ? "–" : v.toPrecision(5) }],
    hooks: {
      setSelect: [() => { follow = false; }],
      setCursor: [(at) => {
        const i = at.cursor.idx, value = i == null ? null : at.data[1][i];
        title.textContent = `${info.label} [${info.unit}]` + (value == null ? "" : `   ${value.toPrecision(6)} at ${at.data[0][i].toFixed(3)} s`);
      }],
    },
  }, [[], []], box);
  plot.over.addEventListener("dblclick", () => { follow = true; });
  const scope = { name, plot, box };
  scopes.push(scope);
  remove.addEventListener("click", () => {
    plot.destroy(); box.remove(); scopes = scopes.filter((other) => other !== scope);
    if (!scopes.some((other) => other.name === name)) delete data[name];
    connect();
  });
  if (keep) connect();
}

function redraw() {
  requestAnimationFrame(redraw);
  if (paused || document.hidden || !data.t.length) return;
  const end = data.t[data.t.length - 1], span = Number($("window").value);
  for (const scope of scopes) {
    const width = scope.box.clientWidth;
    if (width && width !== scope.plot.width) scope.plot.setSize({ width, height: 150 });
    const values = data[scope.name] || [];
    scope.plot.setData([data.t, values.length === data.t.length ? values : new Array(data.t.length).fill(null)], false);
    if (follow) scope.plot.batch(() => {
      scope.plot.setScale("x", { min: end - span, max: end });
      const from = data.t.findIndex((t) => t >= end - span);
      const seen = values.slice(from).filter((v) => v !== null);
      if (seen.length) {
        const low = Math.min(...seen), high = Math.max(...seen), room = (high - low) * 0.08 || Math.max(Math.abs(high) * 0.05, 1e-3);
        scope.plot.setScale("y", { min: low - room, max: high + room });
      }
    });
    else scope.plot.redraw();
  }
  if (!drawn) { drawn = true; requestAnimationFrame(() => performance.mark("first data drawn")); }
}

function showStatus(status) {
  showHead(status);
  drawScene($("scene"), status);
  if (!status.position_rad) return;
  showFigures($("numbers"), [...jointFigures(status), ["world", status.environment.join(", ")], ["authority", Math.round(status.authority * 100) + " %"]]);
  const faults = status.faults.map((fault) => fault.sentence);
  if (status.first && !status.faults.some((fault) => fault.name === status.first.name)) faults.unshift(`cause: ${status.first.sentence}`);
  faults.push(...status.devices);
  $("faults").replaceChildren(...faults.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
  const health = status.health || {};
  const body = $("latency").tBodies[0];
  body.replaceChildren(...["wakeup", "read", "law", "write", "cycle"].map((phase) => {
    const line = document.createElement("tr"), of = health[phase + "_us"] || {};
    for (const text of [phase, ...["p50", "p99", "p99.9", "max"].map((p) => of[p] === undefined ? "–" : of[p].toFixed(1))]) line.append(Object.assign(document.createElement("td"), { textContent: text }));
    return line;
  }));
  const lost = (health.telemetry || {}).dropped ?? health.dropped ?? 0;
  showFigures($("counters"), [["rate", (health.measured_rate_hz || 0).toFixed(1) + " Hz"], ["missed ticks", status.missed], ["dropped messages", lost], ["epoch", status.epoch]]);
  drawHistogram($("histogram"), status.histogram);
}

// How often the loop woke up so late, and took so long: counts of the last seconds in steps of the logarithm.
function drawHistogram(canvas, histogram) {
  if (!histogram) return;
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth || 480, height = 120, foot = 18;
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  const draw = canvas.getContext("2d"), ink = getComputedStyle(document.body).color;
  draw.scale(ratio, ratio);
  draw.font = "11px system-ui, sans-serif";
  const edges = histogram.edges_us, from = Math.log10(edges[0]), to = Math.log10(edges[edges.length - 1]);
  const x = (us) => (Math.log10(us) - from) / (to - from) * width;
  const rows = [["wakeup", "#2563eb"], ["cycle", "#b26a00"]];
  const most = Math.max(1, ...rows.flatMap(([name]) => histogram[name]));
  const bar = (count) => count ? Math.max(2, Math.log1p(count) / Math.log1p(most) * (height - foot - 14)) : 0;
  rows.forEach(([name, colour], row) => {
    draw.fillStyle = colour;
    histogram[name].forEach((count, i) => {
      const left = x(edges[i]), half = (x(edges[i + 1]) - left) / 2 - 0.5, tall = bar(count);
      draw.fillRect(left + row * half, height - foot - tall, half, tall);
    });
    draw.fillText(name, 4 + row * 58, 11);
  });
  draw.fillStyle = ink;
  draw.globalAlpha = 0.6;
  draw.textAlign = "center";
  for (let us = edges[0]; us <= edges[edges.length - 1] * 1.01; us *= 10) {
    draw.fillText(us < 1000 ? us + " µs" : us / 1000 + " ms", Math.min(Math.max(x(us), 16), width - 20), height - 5);
  }
}

function showEvent(event) {
  const text = event.sentence || `${event.event} ${event.name || ""}`;
  const item = Object.assign(document.createElement("li"), { textContent: `${new Date(event.timestamp * 1000).toLocaleTimeString()}  tick ${event.tick}  ${text}` });
  $("events").prepend(item);
  while ($("events").children.length > 100) $("events").lastChild.remove();
}

for (const button of document.querySelectorAll("[data-do]")) button.addEventListener("click", () => press(button.dataset.do));
$("pause").addEventListener("click", () => { paused = !paused; $("pause").textContent = paused ? "Go on" : "Pause"; });
$("add").addEventListener("change", () => { if ($("add").value) addScope($("add").value); $("add").value = ""; });
$("compensation").addEventListener("input", () => { $("share").textContent = Math.round($("compensation").value * 100) + " %"; });
$("compensation").addEventListener("change", () => press("compensation", { share: Number($("compensation").value) }));
$("operator").hidden = !operatorKey;
$("nokey").hidden = !!operatorKey;

fetch("/hello").then((answer) => answer.json()).then((hello) => {
  $("rig").textContent = `${hello.rig} · ${hello.rate_hz} Hz`;
  document.title = `${hello.rig} – rtctl`;
  for (const signal of hello.signals) {
    known[signal.name] = signal;
    $("add").append(Object.assign(document.createElement("option"), { value: signal.name, textContent: `${signal.label} [${signal.unit}]`, title: signal.meaning }));
  }
  START.forEach((name) => addScope(name, false));
  connect();
  redraw();
});
