// The record button of the scope: every tick of the signals shown, kept here and saved as CSV when it is pressed again.

import { $, ask, element, placed } from "./link.js";
import { notice } from "./head.js";

const MOST_BYTES = 400e6;

let recording = null;

export function beginRecord(rig, signals) {
  $("record").addEventListener("click", () => (recording ? recording.abort() : run(rig, signals())));
}

async function run(rig, signals) {
  if (!signals.length) { notice("Not recorded: add a signal first."); return; }
  const mine = recording = new AbortController(), began = Date.now(), beganMs = performance.now(), chunks = [];
  let bytes = 0, why = "";
  const tell = () => {
    const seconds = Math.floor((performance.now() - beganMs) / 1000);
    $("recorded").textContent = `${Math.floor(seconds / 60)}:${String(seconds % 60).padStart(2, "0")} · ${(bytes / 1e6).toFixed(1)} MB · ${signals.length} signals, every tick`;
  };
  show(true);
  tell();
  const clock = setInterval(tell, 500);
  try {
    await placed(async () => {
      const answer = await ask("/ticks.csv?signals=" + encodeURIComponent(signals.join(",")), mine.signal);
      for (const reader = answer.body.getReader(); ;) {
        const { value, done } = await reader.read();
        if (done) { why = "the page's server ended it"; return; }
        chunks.push(value);
        bytes += value.length;
        if (bytes > MOST_BYTES) { why = "as much as a browser should hold"; mine.abort(); }
      }
    });
  } catch (error) {
    if (!mine.signal.aborted) why = error.message;
  }
  clearInterval(clock);
  recording = null;
  show(false);
  $("recorded").textContent = "";
  const name = `${rig.replace(/[^A-Za-z0-9_-]/g, "_")}-${new Date(began).toISOString().replace(/[-:]|\.\d+/g, "")}.csv`;
  if (bytes) save(new Blob(chunks, { type: "text/csv" }), name);
  notice(bytes ? `Saved ${name}${why ? ": " + why : ""}` : `Nothing recorded: ${why || "no data came"}`, !!why || !bytes);
}

function show(on) {
  $("record").setAttribute("aria-pressed", String(on));
  $("record").querySelector("span").textContent = on ? "Stop and save" : "Record";
}

function save(blob, name) {
  const url = URL.createObjectURL(blob), link = element("a", { href: url, download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60000);
}

addEventListener("beforeunload", (event) => { if (recording) event.preventDefault(); });
