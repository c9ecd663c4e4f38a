"""Is DELAY told of a rig that samples rarely, and only of one that is late?

`python tests/foreign_delays.py --rigs 200`: random rigs, certified, on the joints and in the arms of
`tests/foreign_rests.py`; of those only the ones that declare a sample every second or third tick, with their
declared delay and lag exactly. The arm moves to and fro for 15 s and then leans, in free motion or on a world
that the law renders. *False* is DELAY of such a rig; *told* is who has it within 16 s of a delay that grew,
while it ran, to a tick more than the proof covers beside the age of the samples (decision 0157).
"""

import math
from typing import NamedTuple

import click
import numpy as np
from foreign_arms import Rig
from foreign_luck import Luck as _Luck
from foreign_rests import drawn, every_rig, parser_of

from rtctl.control.vocabulary import Environment, Fault

MOVES_S, LEANS_S, GROWS_S = 15.0, 5.0, 4.0
LATEST_TICKS = 12.0
"""Of a proof that covers more nothing is asked: a line of the plant is not longer."""
WORLDS = ("free", "wall", "wall", "spring", "detents", "damper")


class Luck(_Luck):
    """Numbers of one world of this judge."""

    FIRST = 157


class Told(NamedTuple):
    """Ticks between samples, ticks of delay (lag included), of the proof; mean delay that motion showed, of
    true and of grown ones; whether DELAY came without cause; s until it came with one, NaN: it did not."""

    every: int
    delay: float
    proof: float
    shown: float
    shown_grown: float
    false: bool
    told_s: float


def _armed(case, seed):
    luck, a = Luck(seed), case.axis.copy()
    declared = case.loaded.options["timing"]
    a["sample_ticks"], a["late_ticks"] = declared["sample_every_ticks"], declared["transport_delay_ticks"]
    hz = case.loaded.config.axis[0].drive.current_loop_hz
    a["lag_s"] = 1 / (2 * math.pi * hz) if hz else 0.0
    a["manner"], a["to_s"] = luck.one(0, 1, 2), 3.0 + MOVES_S
    world, at = luck.one(*WORLDS), float(a["amplitude"][0]) * luck.within(-0.5, 0.5)
    rig = Rig(case.loaded, a, seed)
    c, k_c = rig.law[3], float(rig.law[2]["coupling_stiffness_nm_rad"][0, 0])
    c["environment_kind"], c["environment_side"] = int(Environment[world.upper()]), 1
    c["environment_stiffness_nm_rad"], c["environment_center_rad"] = k_c * luck.spread(0.2, 30), at
    c["environment_damping_nms_rad"] = 3 * a["viscous"]
    c["environment_pitch_rad"] = max(0.3 * abs(at), 2e-3)
    return (rig if rig.arm() else None), world


def _followed(rig, seconds):
    """(mean delay that motion showed, whether DELAY came, s it took)."""
    seen, from_s = [], rig.time_s
    while rig.time_s < from_s + seconds and rig.active:
        rig.run(0.25)
        if rig.law[1]["running_count"][0, 0]:
            seen.append(float(rig.law[1]["running_delay"][0, 0]))
    delay = not rig.active and rig.fault == Fault.DELAY.bit_length() - 1
    return float(np.mean(seen)) if seen else math.nan, delay, rig.time_s - from_s


def judged(case, seed):
    """A `Told`; None for a rig that samples in every tick, was not armed, or whose proof covers too much."""
    every = case.loaded.options["timing"]["sample_every_ticks"]
    if every == 1:
        return None
    rig, world = _armed(case, seed)
    if rig is None:
        return None
    period_s, p = rig.period_s, rig.law[2]
    proof, lag = float(p["proof_delay_s"][0, 0]) / period_s, float(rig.a["lag_s"][0]) / period_s
    shown, false, _ = _followed(rig, MOVES_S + LEANS_S + 3 - rig.time_s)
    late, _ = _armed(case, seed)
    late.run(GROWS_S - late.time_s)
    delay = float(late.a["late_ticks"][0]) + lag
    grown = math.ceil(proof - (every - 1) - lag) + 1
    told_s, shown_grown = math.nan, math.nan
    if grown <= LATEST_TICKS:
        late.a["late_ticks"] = grown
        shown_grown, told, after_s = _followed(late, 16.0)
        told_s = after_s if told else math.nan if late.active else math.inf
    if false:
        click.echo(
            f"seed {seed}: false, every {every}, {case.kind}, {world}: {delay:.2f} ticks, shown {shown:.2f}, "
            f"proof {proof:.2f}"
        )
    return Told(every, delay, proof, shown, shown_grown, false, told_s)


def main():
    """Print false alarms, those told and when, and how far the delay shown is off."""
    asked = parser_of(__doc__).parse_args()
    found = [told for _, _, told in every_rig(asked, drawn, judged)]
    for every in sorted({told.every for told in found}):
        of = [told for told in found if told.every == every]
        off = np.array([told.shown - told.delay for told in of])
        grown = [told for told in of if not math.isnan(told.shown_grown)]
        told_s = [told.told_s for told in grown if math.isfinite(told.told_s)]
        other = sum(math.isinf(told.told_s) for told in grown)
        click.echo(
            f"a sample every {every} ticks: {len(of)} rigs, false {sum(told.false for told in of)}; told "
            f"{len(told_s)} of {len(grown)} that were a tick later than proved ({other} ended by another "
            f"fault), after {np.median(told_s) if told_s else math.nan:.2f} s; delay shown off by "
            f"{np.nanmin(off):+.2f} to {np.nanmax(off):+.2f}, mean {np.nanmean(off):+.2f} ticks"
        )


if __name__ == "__main__":
    main()
