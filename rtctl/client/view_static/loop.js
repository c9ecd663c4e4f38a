// How punctual the loop is: percentiles, a histogram of the last seconds, counters; and what happened since the page was opened.

import { $, element } from "./link.js";
import { colour } from "./scene.js";

const PHASES = ["wakeup", "read", "law", "write", "cycle"], PARTS = ["p50", "p99", "p99.9", "max"];
const MOST_EVENTS = 100;
const TOP = 20, FOOT = 20;

/** Named numbers, each kept together where the line breaks. */
export function showFigures(place, figures) {
  place.replaceChildren(...figures.map(([name, value]) => element("span", {}, element("small", { textContent: name }), String(value))));
}

export function showLoop(status) {
  const health = status.health || {};
  $("latency").tBodies[0].replaceChildren(...PHASES.map((phase) => {
    const of = health[phase + "_us"] || {};
    return element("tr", {}, element("th", { scope: "row", textContent: phase }), ...PARTS.map((part) => element("td", { textContent: of[part] == null ? "–" : of[part].toFixed(1) })));
  }));
  const recording = health.recording;
  showFigures($("counters"), [
    ["rate", `${(health.measured_rate_hz || 0).toFixed(1)} Hz`], ["missed ticks", status.missed], ["dropped messages", (health.telemetry || {}).dropped ?? 0], ["epoch", status.epoch],
    ["daemon's recording", recording ? (recording.broken ? "broken" : `${(recording.bytes / 1e6).toFixed(1)} MB`) : "off"],
  ]);
  drawHistogram($("histogram"), status.histogram);
}

// How often the loop woke up so late, and took so long: counts in steps of the logarithm.
function drawHistogram(canvas, histogram) {
  if (!histogram || !canvas.clientWidth) return;
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio);
  const draw = canvas.getContext("2d"), base = height - FOOT;
  draw.scale(ratio, ratio);
  draw.font = "12px system-ui, sans-serif";
  const edges = histogram.edges_us, from = Math.log10(edges[0]), to = Math.log10(edges[edges.length - 1]);
  const x = (us) => (Math.log10(us) - from) / (to - from) * width;
  const rows = [["wakeup", colour("curve-0"), "woke up late by"], ["cycle", colour("curve-3"), "cycle took"]];
  const most = Math.max(1, ...rows.flatMap(([name]) => histogram[name]));
  const bar = (count) => (count ? Math.max(2, Math.log1p(count) / Math.log1p(most) * (base - TOP)) : 0);
  draw.strokeStyle = colour("grid"); draw.beginPath();
  for (let us = edges[0]; us <= edges[edges.length - 1] * 1.01; us *= 10) { draw.moveTo(x(us), TOP); draw.lineTo(x(us), base); }
  draw.moveTo(0, base); draw.lineTo(width, base); draw.stroke();
  let left = 0;
  rows.forEach(([name, fill, text], row) => {
    draw.fillStyle = fill;
    histogram[name].forEach((count, i) => {
      const at = x(edges[i]), half = (x(edges[i + 1]) - at) / 2 - 0.5, tall = bar(count);
      draw.fillRect(at + row * half, base - tall, half, tall);
    });
    draw.fillRect(left, 3, 9, 9);
    draw.fillStyle = colour("ink-2"); draw.textAlign = "left";
    draw.fillText(text, left + 14, 12);
    left += draw.measureText(text).width + 32;
  });
  draw.textAlign = "center";
  for (let us = edges[0]; us <= edges[edges.length - 1] * 1.01; us *= 10) {
    draw.fillText(us < 1000 ? us + " µs" : us / 1000 + " ms", Math.min(Math.max(x(us), 18), width - 22), height - 5);
  }
}

export function showEvent(event) {
  const text = event.sentence || `${event.event} ${event.name || ""}`;
  const when = element("time", { textContent: new Date(event.timestamp * 1000).toLocaleTimeString(), title: `tick ${event.tick}` });
  $("events").prepend(element("li", { className: event.event }, when, " ", text));
  while ($("events").children.length > MOST_EVENTS) $("events").lastChild.remove();
  $("quiet").hidden = true;
}
