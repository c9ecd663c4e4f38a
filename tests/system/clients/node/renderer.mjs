// A renderer written from docs/protocol.md alone. It subscribes, holds the lease, moves the virtual object, stops.
//
//   node renderer.mjs ipc DIR/RIG          on the daemon's machine
//   node renderer.mjs tcp HOST:PORT KEY    with a key file of `rtctl keys new`
//
// Prints one JSON object; exits 1 when anything is not as the document says.

import { readFileSync } from "node:fs";
import { setTimeout as sleep } from "node:timers/promises";
import { decode, encode } from "@msgpack/msgpack";
import { Dealer, Subscriber } from "zeromq";

const [way, where, keyFile] = process.argv.slice(2);

function keys(path) {
  const values = Object.fromEntries(
    readFileSync(path, "utf8").trim().split("\n").map((line) => line.match(/^(\w+) = "(.*)"$/).slice(1)),
  );
  return {
    curveServerKey: values.server_key,
    curvePublicKey: values.public_key,
    curveSecretKey: values.secret_key,
  };
}

function endpoints() {
  if (way === "ipc") {
    return { command: `ipc://${where}/command`, targets: `ipc://${where}/targets`, telemetry: `ipc://${where}/telemetry` };
  }
  const [host, port] = where.split(":");
  const at = (offset) => `tcp://${host}:${Number(port) + offset}`;
  return { command: at(0), targets: at(1), telemetry: at(2) };
}

const security = way === "tcp" ? keys(keyFile) : {};
const at = endpoints();
const command = new Dealer({ linger: 0, immediate: true, receiveTimeout: 20000, sendTimeout: 20000, ...security });
const targets = new Dealer({ linger: 0, conflate: true, ...security });
const telemetry = new Subscriber({ linger: 0, receiveHighWaterMark: 5000, ...security });
command.connect(at.command);
targets.connect(at.targets);
telemetry.connect(at.telemetry);
telemetry.subscribe("rtctl/state");

let nextId = 0;
let turn = Promise.resolve();

function ask(op, more = {}) {
  const answer = turn.then(async () => {
    const id = ++nextId;
    await command.send(encode({ id, op, ...more }));
    for (;;) {
      const reply = decode((await command.receive()).at(-1));
      if (reply.id === id) return reply;
    }
  });
  turn = answer.catch(() => undefined);
  return answer;
}

async function granted(op, more) {
  const reply = await ask(op, more);
  if (!reply.ok) throw new Error(`${op}: ${reply.error.code}: ${reply.error.text}`);
  return reply;
}

function must(condition, what) {
  if (!condition) throw new Error(what);
}

let state = null;
const heard = { samples: 0, gaps: 0 };

async function listen() {
  for await (const [topic, payload] of telemetry) {
    must(topic.toString() === "rtctl/state", "topic");
    for (const sample of decode(payload)) {
      if (state !== null && sample.sequence !== state.sequence + 1) heard.gaps += 1;
      state = sample;
      heard.samples += 1;
    }
  }
}

async function until(condition, what, seconds = 60) {
  const end = Date.now() + 1000 * seconds;
  while (!(await condition())) {
    must(Date.now() < end, `waited too long: ${what}`);
    await sleep(5);
  }
}

const ACTIVE = 3;
const IDLE = 1;

async function main() {
  listen().catch(fail);
  const hello = await granted("hello");
  must(hello.result.protocol === 1, "protocol");
  await granted("environment", { axis: 0, kind: "remote" });
  await until(() => state !== null, "a sample");

  const epoch = (await granted("status")).epoch;
  const given = (await granted("lease", { epoch })).result;
  const second = await ask("lease", { epoch });
  must(second.error?.code === "lease_taken", "a second lease was given");

  let goal = given.target_position_rad[0];
  const start = goal;
  let sending = true;
  const send = (async () => {
    while (sending) {
      await targets.send(encode({ lease: given.lease, epoch, position_rad: [goal], velocity_rad_s: [0] }));
      await sleep(5);
    }
  })();
  const renew = setInterval(() => ask("lease", { epoch, lease: given.lease }).catch(fail), 250 * given.silence_s);

  await until(() => state.lease_held === 1, "the lease in the loop");
  await until(async () => {
    if (state.state === ACTIVE) return true;
    await ask("arm", { epoch });
    await sleep(200);
    return false;
  }, "ACTIVE");
  const before = state.position_rad[0];
  for (let step = 1; step <= 30; step += 1) {
    goal = start + 0.004 * step; // a little: a virtual object that drives the hand gives energy, which is limited
    await sleep(20);
  }
  await until(() => {
    must(state.state === ACTIVE, "the rig stopped on the way");
    return state.position_rad[0] > before + 0.015;
  }, "the joint to follow");
  const moved = state.position_rad[0] - before;

  await granted("stop");
  await until(() => state.state === IDLE, "IDLE after the stop");
  clearInterval(renew);
  sending = false;
  await send;
  const old = { lease: given.lease, position_rad: [goal + 0.5] };
  const void_ = await ask("target", { ...old, epoch });
  const lost = await ask("target", { ...old, epoch: void_.epoch });
  must(void_.error?.code === "wrong_epoch", "a target of before the stop was taken");
  must(lost.error?.code === "lease_lost", "the lease outlived the stop");
  console.log(JSON.stringify({ role: hello.result.role, moved_rad: moved, ...heard }));
  process.exit(0);
}

function fail(error) {
  console.error(error);
  process.exit(1);
}

main().catch(fail);
