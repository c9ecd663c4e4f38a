// node look.mjs URL KEY FOLDER CHROMIUM: opens both pages, presses buttons, takes pictures, prints one JSON object.
import { chromium } from "playwright-core";

const [, , url, key, folder, executablePath] = process.argv;
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox"] });
const facts = { foreign: [], errors: [] };
const origin = new URL(url).origin;

async function open(path, size, withKey) {
  const context = await browser.newContext({ viewport: size, bypassCSP: true });
  const page = await context.newPage();
  page.on("request", (request) => { if (!request.url().startsWith(origin)) facts.foreign.push(request.url()); });
  page.on("pageerror", (error) => facts.errors.push(String(error)));
  page.on("console", (message) => { if (message.type() === "error" && !message.text().includes("403")) facts.errors.push(message.text()); });
  const began = Date.now();
  await page.goto(url + path + (withKey ? "#key=" + key : ""), { waitUntil: "domcontentloaded" });
  await page.waitForFunction(() => !["connecting", "NO DATA"].includes(document.getElementById("state").textContent), null, { timeout: 30000 });
  const ms = Date.now() - began;
  await page.evaluate(async () => { window.head = await import("/head.js"); window.link = await import("/link.js"); if (document.getElementById("scopes")) window.scope = await import("/scope.js"); });
  return [page, ms];
}
const state = (page) => page.textContent("#state");
const becomes = (page, wanted) => page.waitForFunction((text) => document.getElementById("state").textContent === text, wanted, { timeout: 60000 });

const [view, ms] = await open("", { width: 1280, height: 1000 }, true);
facts.interactive_ms = ms;
await view.waitForFunction(() => document.querySelectorAll(".scope canvas").length === 4);
await view.click("[data-do=arm]");
await becomes(view, "ACTIVE");
await view.waitForFunction(() => scope.data.t.length > 300, null, { timeout: 60000 }); // a busy machine takes its time
facts.points = await view.evaluate(() => scope.data.t.length);
facts.signals = await view.evaluate(() => document.querySelectorAll("#add option").length);
await view.selectOption("#add", "velocity_rad_s.0");
await view.waitForFunction(() => document.querySelectorAll(".scope canvas").length === 5);
await view.waitForFunction(() => (scope.data["velocity_rad_s.0"] ?? []).filter((v) => v !== null).length > 50, null, { timeout: 60000 });
facts.velocity_points = await view.evaluate(() => scope.data["velocity_rad_s.0"].filter((v) => v !== null).length);
await view.screenshot({ path: folder + "/view.png", fullPage: true });
// pause holds the picture while data comes; the cursor says value and time; dragging zooms in, a double click follows again
const range = () => view.evaluate(() => { const x = scope.scopes[0].plot.scales.x; return [x.min, x.max]; });
const more = () => view.evaluate(() => scope.data.t.at(-1)).then((now) => view.waitForFunction((before) => scope.data.t.at(-1) > before + 0.5, now, { timeout: 60000 }));
await view.click("#pause");
facts.paused = await view.textContent("#pause");
facts.held = [await range()];
await more();
facts.held.push(await range());
await view.click("#pause");
const over = view.locator(".u-over").first();
await over.scrollIntoViewIfNeeded();
const box = await over.boundingBox();
await view.mouse.move(box.x + 0.75 * box.width, box.y + 40);
await view.waitForFunction(() => / at [0-9.]+ s$/.test(document.querySelector(".scope output").textContent), null, { timeout: 60000 });
facts.cursor = await view.textContent(".scope output");
await view.mouse.down();
await view.mouse.move(box.x + 0.95 * box.width, box.y + 45, { steps: 5 });
await view.mouse.up();
await view.waitForFunction(() => !scope.view.follow && scope.scopes[0].plot.scales.x.max - scope.scopes[0].plot.scales.x.min < 5, null, { timeout: 60000 });
facts.zoomed = [await range()];
await more();
facts.zoomed.push(await range());
await over.dblclick();
await view.waitForFunction(() => scope.view.follow && scope.data.t.at(-1) - scope.scopes[0].plot.scales.x.max < 1, null, { timeout: 60000 });
facts.followed = await range();

const [phone] = await open("", { width: 390, height: 844 }, false);
facts.operator_hidden = await phone.evaluate(() => document.getElementById("operator").hidden);
facts.arm_without_key = await phone.evaluate(() => link.press("arm").then((said) => said.error || ""));
facts.overflow = await phone.evaluate(() => document.documentElement.scrollWidth > document.documentElement.clientWidth);
await phone.waitForTimeout(1500);
await phone.screenshot({ path: folder + "/phone.png" });
await phone.screenshot({ path: folder + "/phone-whole.png", fullPage: true });
// a fault that came meanwhile, of a loop that a busy machine kept waiting, is answered as a person would: RESET, ARM, and STOP again
for (let tries = 0; tries < 3 && await state(phone) !== "IDLE"; tries++) {
  if (await state(view) === "FAULT") await view.click("[data-do=reset]"), await becomes(view, "IDLE"), await view.click("[data-do=arm]"), await becomes(view, "ACTIVE");
  await phone.click("#stop");
  await phone.waitForFunction(() => ["IDLE", "FAULT"].includes(document.getElementById("state").textContent), null, { timeout: 60000 });
}
facts.stopped = await state(phone);

// every world, at a desk and on a phone; a slow hand is on the simulated rig all the while
const [world] = await open("world", { width: 1280, height: 900 }, true);
const [small] = await open("world", { width: 390, height: 844 }, true);
await world.click("[data-do=arm]");
await becomes(world, "ACTIVE");
await world.waitForTimeout(1500);
facts.frame_hz = {}, facts.world_overflow = [];
for (const kind of ["free", "wall", "spring", "detents", "damper", "ball"]) {
  await world.click(`#kinds >> text="${kind}"`);
  const law = kind === "ball" ? "wall" : kind;
  await world.waitForFunction(([law, kind]) => head.newest.environment[0] === law && head.newest.world.kind === kind, [law, kind], { timeout: 60000 });
  await world.waitForTimeout(1200);
  // a browser that stands for a moment lets the rig hold until its targets come again; a fault does not go by itself
  await world.waitForFunction(() => head.newest.state === "ACTIVE" && head.newest.world.trouble === "", null, { timeout: 60000 });
  facts[kind] = await world.evaluate(() => [head.newest.environment[0], head.newest.world.kind, head.newest.state, head.newest.world.trouble]);
  facts.frame_hz[kind] = await world.evaluate(() => head.newest.world.frame_hz);
  await world.screenshot({ path: `${folder}/world-${kind}.png` });
  if (await small.evaluate(() => document.documentElement.scrollWidth > document.documentElement.clientWidth)) facts.world_overflow.push(kind);
  await small.screenshot({ path: `${folder}/world-phone-${kind}.png` });
}
await world.screenshot({ path: folder + "/world.png" });
await world.keyboard.press("Escape");
await becomes(world, "IDLE");
console.log(JSON.stringify(facts));
await browser.close();
