// Drawing curves with uPlot: one plot for each signal, over a time axis that all of them share.

import { colour } from "./scene.js";

const HEIGHT = 116, FOOT = 42, LABEL = 18, WIDE = 500;
export const CURVES = 6;

/** Numbers as a person reads them: as many digits as tell ticks apart, a real minus. */
export function tidy(value, step = 0) {
  if (value == null) return "–";
  const digits = step ? Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) : 0;
  const size = Math.abs(value);
  const text = step && digits < 7 && size < 1e7 ? value.toFixed(digits) : size && (size < 1e-4 || size >= 1e6) ? value.toExponential(3) : String(Number(value.toPrecision(4)));
  return text.replace("-", "−");
}

export function valueText(info, value) {
  if (value == null) return "–";
  const name = info.names && info.names[value];
  return name || `${tidy(value)}${info.unit ? " " + info.unit : ""}`;
}

const isNamed = (info) => Object.keys(info.names || {}).length > 0;

/** A plot in `box`; `last` has the labels of the time axis. `moved` hears of a zoom, `over` of the cursor. */
export function makePlot(box, info, slot, last, { zoomed, over }) {
  const ink = colour("ink-2"), grid = { stroke: colour("grid"), width: 1 }, curve = colour("curve-" + (slot % CURVES));
  const font = "12px system-ui, sans-serif";
  const tick = { stroke: ink, font, grid, ticks: { stroke: colour("grid"), width: 1, size: 5 } };
  const named = isNamed(info), wide = box.clientWidth > WIDE, left = wide ? 92 : 72, label = wide ? info.unit : "";  // a phone has the unit at the value only
  return new uPlot({
    width: box.clientWidth || 600, height: HEIGHT + (last ? FOOT : 8),
    cursor: { sync: { key: "rtctl", setSeries: false }, drag: { x: true, y: false, setScale: false }, y: false },
    legend: { show: false },
    padding: [8, 14, last ? 0 : 8, 0],
    scales: { x: { time: false, range: (_, low, high) => [low, high] }, y: { range: (_, low, high) => room(low, high, named) } },
    axes: [
      { ...tick, show: true, size: last ? FOOT - LABEL : 0, space: 70, label: last ? "time since the page's first tick [s]" : undefined, labelFont: font, labelSize: last ? LABEL : 0, gap: 4, values: last ? (_, ticks, __, ___, step) => ticks.map((t) => (t < 0 ? "" : tidy(t, step))) : () => [] },
      { ...tick, size: label ? left - LABEL : left, space: 26, label: label || undefined, labelFont: font, labelSize: label ? LABEL : 0,
        ...(named ? { splits: (_, __, low, high) => whole(low, high), values: (_, ticks) => ticks.map((v) => info.names[v] || "") } : { values: (_, ticks, __, ___, step) => ticks.map((v) => tidy(v, step)) }) },
    ],
    series: [{}, { stroke: curve, width: 1.75, spanGaps: false, points: { show: false }, paths: named ? uPlot.paths.stepped({ align: 1 }) : undefined }],
    hooks: {
      setSelect: [(plot) => {
        if (plot.select.width < 5) return;
        zoomed(plot.posToVal(plot.select.left, "x"), plot.posToVal(plot.select.left + plot.select.width, "x"));
        plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
      }],
      setCursor: [(plot) => over(plot.cursor.left < 0 ? null : plot.cursor.idx)],
    },
  }, [[], []], box);
}

function room(low, high, named) {
  if (low == null) return [-1, 1];
  if (named) return [Math.floor(low) - 0.6, Math.ceil(high) + 0.6];
  const more = (high - low) * 0.08 || Math.max(Math.abs(high) * 0.05, 1e-3);
  return [low - more, high + more];
}

function whole(low, high) {
  const out = [];
  for (let k = Math.ceil(low); k <= high; k++) out.push(k);
  return out;
}
