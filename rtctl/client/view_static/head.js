// The head of both pages: state, what to do next, faults with their remedy, refusals, the operator's buttons, STOP.

import { $, element, operatorKey, press, redraw } from "./link.js";

const QUIET_MS = 1000;       // without any status for so long the page's server is gone
const NOTICE_MS = 8000;
const ARMED_WITHIN_MS = 2000;
const READ_MS = 1000;        // what is to be read before it is agreed to: no double click does

/** The last status. */
export let newest = {};
let cameAt = 0, why = "", rig = "rtctl", noticeEnds = 0, stopFailed = "", stops = 0, armPressedAt = 0;

/** A line that vanishes: what was refused, or done. It goes at the next change of state, too. */
export function notice(text, bad = true) {
  $("notice").textContent = text;
  $("notice").hidden = !text;
  $("notice").className = bad ? "notice bad" : "notice";
  noticeEnds = performance.now() + NOTICE_MS;
  askForHands(false);
}

/** Press a button and show what came of it. */
export async function ordered(name, body) {
  const said = await press(name, body);
  if (said.error) notice(`${LABELS[name] || name}: ${said.error}`);
  else if (!$("notice").hidden) notice("");
  return said;
}
const LABELS = { arm: "Not armed", reset: "Not reset", tare: "Not tared", compensation: "Not changed", display: "Not changed", world: "Not changed" };

/** Of a tare that was refused for a pull: the same button says that nobody touches the device, while the pull is shown. */
let asks = 0;
function askForHands(asked) {
  const tare = document.querySelector("[data-do=tare]");
  if (asked) { asks = performance.now(); tare.dataset.hands = "off"; } else delete tare.dataset.hands;
  tare.textContent = asked ? "Tare: nobody touches it" : "Tare";
}

export async function stop() {
  const mine = ++stops;
  const said = await press("stop");
  if (mine !== stops) return;  // an answer to an earlier press may come later: it must not hide that the last one failed
  stopFailed = said.error || "";
  if (!stopFailed) notice("STOP was sent.", false);
  show();
}

export function showHello(hello) {
  rig = hello.rig;
  $("rig").textContent = rig;
  $("rate").textContent = `${hello.rate_hz} Hz`;
}

export function showStatus(status) {
  if (newest.state && status.state !== newest.state) {
    if (!$("notice").hidden) notice("");
    if (["IDLE", "STOPPING"].includes(status.state)) stopFailed = "";
  }
  newest = status;
  cameAt = performance.now();
  why = status.silent;
  show();
}

export function lost(reason) { cameAt = -Infinity; why = reason; show(); }

/** Whether what is shown is old. */
export function isStale() { return !newest.state || !!newest.silent || performance.now() - cameAt > QUIET_MS; }

let deadSince = null;
function show() {
  const stale = isStale(), state = stale ? "NO DATA" : newest.state;
  if (stale && deadSince === null) deadSince = new Date(Date.now() - 1000 * (newest.silent_s || 0));
  if (!stale) deadSince = null;
  $("state").textContent = newest.state || why !== "connecting" ? state : "connecting";
  $("state").className = "badge " + state.replace(" ", "-");
  document.title = `${state} · ${rig}`;
  document.body.classList.toggle("stale", stale);
  $("next").textContent = stale ? "What is shown is old." : newest.next;
  $("lease").textContent = stale ? "" : [newest.lease && "a renderer holds the lease", newest.waiver && "without real-time rights"].filter(Boolean).join(" · ");
  showButtons(stale, state);
  showAlert(stale);
}

function showButtons(stale, state) {
  const lead = stale || newest.faults.length ? "" : { IDLE: "arm", FAULT: "reset", ESTOP: "reset" }[state];
  for (const button of document.querySelectorAll("[data-do]")) {
    const hindrance = stale ? "no data come from the rig" : newest.hindrances[button.dataset.do] || "";
    button.setAttribute("aria-disabled", String(!!hindrance));
    button.title = hindrance;
    button.classList.toggle("lead", !hindrance && button.dataset.do === lead);
  }
}

function showAlert(stale) {
  const lines = [];
  if (stopFailed) lines.push({ name: "STOP NOT CONFIRMED", wrong: stopFailed, remedy: "press the hardware emergency stop" });
  if (stale && cameAt) {
    const cause = newest.first ? ` (${newest.first.name})` : "";
    const last = newest.state ? `the last state was ${newest.state}${cause}; ` : "";
    lines.push({ name: "NO DATA", place: `since ${deadSince.toLocaleTimeString()}`, wrong: last + why,
      remedy: "the rig may still be powered: use its emergency stop if in doubt, then see whether the daemon runs" });
  }
  if (!stale) lines.push(...faultLines(), ...newest.devices.map((text) => ({ name: "device", wrong: text })), ...(newest.health.warnings || []).map((one) => ({ name: "warning", wrong: one.text, mild: true })), ...brokenLines(newest));
  if (!stale && newest.world && newest.world.trouble) lines.push({ name: "world", wrong: newest.world.trouble, mild: true });
  $("alert").hidden = !lines.length;
  $("alert").classList.toggle("mild", lines.every((line) => line.mild));
  redraw($("alert"), lines, () => lines.map(alertLine));
}

function faultLines() {
  const present = newest.faults.map((fault) => fault.name), cause = newest.first;
  const others = newest.faults.filter((fault) => !cause || fault.name !== cause.name);
  const lines = cause ? [{ ...cause, lead: "stopped by ", gone: !present.includes(cause.name) }] : [];
  return [...lines, ...others.map((fault) => ({ ...fault, lead: cause ? "also " : "" }))];
}

function brokenLines({ health, unread }) {
  const broken = [["recording", health.recording], ["event log", health.log]].filter(([, one]) => one && one.broken);
  const lines = broken.map(([what, one]) => ({ name: `${what} broken`, wrong: one.broken, remedy: "make room on the disk, or see its rights", mild: true }));
  return [...lines, ...Object.entries(unread).filter(([, why]) => why).map(([what, why]) => ({ name: `${what} not read`, wrong: why, mild: true }))];
}

function alertLine(line) {
  const place = line.place || [line.axis && `axis ${line.axis}`, line.channel, line.device].filter(Boolean).join(" · ");
  const parts = [element("strong", { textContent: (line.lead || "") + line.name })];
  if (place) parts.push(" ", element("span", { className: "place", textContent: place }));
  if (line.gone) parts.push(" ", element("span", { className: "place", textContent: "(gone now)" }));
  parts.push(element("span", { className: "wrong", textContent: [line.detail, line.wrong].filter(Boolean).join("; ") }));
  if (line.remedy) parts.push(element("span", { className: "remedy" }, element("b", { textContent: "What to do: " }), line.remedy));
  return element("div", { className: "line" }, ...parts);
}

setInterval(() => {
  if (!$("notice").hidden && performance.now() > noticeEnds) notice("");
  if (armPressedAt && performance.now() - armPressedAt > ARMED_WITHIN_MS) {
    armPressedAt = 0;
    if (newest.state === "IDLE") notice("Not armed: the rig was not ready yet (force tared, no fault for half a second). Press Arm again.");
  }
  if (!document.hidden && cameAt) show();
}, 250);

for (const button of document.querySelectorAll("[data-do]")) {
  button.addEventListener("click", async () => {
    if (button.getAttribute("aria-disabled") === "true") { notice(`${button.textContent}: ${button.title}`); return; }
    if (button.dataset.hands && performance.now() - asks < READ_MS) return;
    const said = await ordered(button.dataset.do, button.dataset.hands ? { hands: "off" } : {});
    if (button.dataset.do === "arm" && said.ok) armPressedAt = performance.now();
    if (button.dataset.do === "tare") askForHands((said.error || "").includes("--hands-off"));
  });
}
$("stop").addEventListener("click", stop);
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !event.repeat) stop(); });
$("operator").hidden = !operatorKey;
$("nokey").hidden = !!operatorKey;
