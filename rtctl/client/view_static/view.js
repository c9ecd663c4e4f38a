// The first page: the rig, the scope, events, the loop.

import { $, Stream, operatorKey } from "./link.js";
import { lost, ordered, showHello, showStatus } from "./head.js";
import { showEvent, showFigures, showLoop } from "./loop.js";
import { beginDisplay, showDisplay } from "./display.js";
import { beginPhase, phaseSignals } from "./phase.js";
import { beginRecord } from "./record.js";
import { axisFacts, drawScene, showAxes, showLegend } from "./scene.js";
import { begin, take, wanted } from "./scope.js";

$("help").hidden = !operatorKey;
const percent = (share) => `${Math.round(share * 100)} %`;
const frictionNow = (health) => ((health || {}).friction || []).filter((one) => one.factor).map((one) =>
  [`friction of ${one.axis}, 1 as learned`, `${one.factor.value.toFixed(2)} (${one.factor.low.toFixed(2)} to ${one.factor.high.toFixed(2)})` +
    (one.followed == null ? "" : `, compensation ${one.adapting === false ? "held " : ""}at ${one.followed.toFixed(3)}`)]);
let rig = null, axes = [], facts = [], dragged = false;

const stream = new Stream(() => wanted(phaseSignals()), {
  hello(hello) {
    if (rig !== null && rig !== hello.rig) location.reload();  // another rig has taken this port: other signals
    showHello(hello);
    axes = hello.axes.map((axis) => axis.name); facts = axisFacts(hello);
    if (rig !== null) return;
    rig = hello.rig;
    const saved = begin(hello, () => stream.open());
    beginPhase(hello, saved, () => stream.open());
    beginRecord(rig, () => wanted());
    beginDisplay(hello);
  },
  ticks: (columns) => take(columns, phaseSignals()),
  event: showEvent,
  lost,
  status(status) {
    showStatus(status);
    if (!status.position_rad) return;
    status.axes = axes; status.facts = facts;
    drawScene($("scene"), status);
    showLegend($("legend"), status);
    showAxes($("axes").tBodies[0], status);
    const shares = [...new Set(status.compensation.map(percent))];
    showFigures($("numbers"), [["soft-start authority", percent(status.authority)], ["friction compensation", shares.join(", ")], ...frictionNow(status.health)]);
    if (!dragged) { $("compensation").value = status.compensation[0]; $("share").textContent = shares[0]; }
    showDisplay(status);
    showLoop(status);
  },
});

$("compensation").addEventListener("input", () => { dragged = true; $("share").textContent = percent($("compensation").value); });
$("compensation").addEventListener("change", async () => {
  await ordered("compensation", { share: Number($("compensation").value) });
  setTimeout(() => { dragged = false; }, 500);  // until what is in force has come back
});
