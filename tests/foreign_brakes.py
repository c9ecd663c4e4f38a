"""Does the law brake, hold, stop and track without ringing, feeding a hand, or kicking it?
`python tests/foreign_brakes.py --rigs 100`; `--only HOLD` asks one state alone.

Random certified rigs on the joints of `tests/foreign_braked.py`, rigid or elastic, up to six ticks late, in
hands that only give way: 0 to 500 N m/rad, 0 to 1 N m s/rad, 0 to .02 kg m^2, most of them hardly damped.
Each run is set beside itself with the motor dead from the same moment on. *Rings* is who moves on by more
than `QUIET` and 1.25 times what the dead motor leaves, or grows; *fed* is who is given more than `FED_J` by
the motor in the second half; *kicks* is a torque that changes by more than its rate; *late* a stop that is
not over in its ticks; *out* who leaves the travel; *off* a step that does not arrive; *ends* a fault, or a
flag that nothing here should raise.
"""

import argparse
import math
import tempfile
from collections import Counter
from types import SimpleNamespace

import click
import foreign_braked
import numpy as np
from foreign_braked import PLACE, SENT, SPEED, STATE, TOOK, Rig
from foreign_trials import Luck, Seen, Trial, beside_dead, chatter, drawn, ended, hand_of, pull

from rtctl.control.vocabulary import Environment, Fault, Program, ProgramFlag, Shape, State
from rtctl.errors import ConfigError
from rtctl.experiments.positioning import Case as Track
from rtctl.experiments.positioning_on_rig import fields_of


def brake(case, seed):
    """A hand grips the turning joint: the guard trips, or the host brakes; some let go and grip again."""
    trial = Trial(case, seed)
    if not trial.armed:
        return None
    rig, luck = trial.rig, trial.luck
    trial.ask(Program.SERVO, velocity_rad_s=luck.spread(0.2, 2.0) * luck.one(1, -1))
    trial.run(0.6)
    hand = hand_of(luck)
    rig.grip(*hand)
    trial.run(0.15)
    if not trial.flags:
        trial.ask(Program.BRAKE)
    if luck.one(True, False):
        rig.let_go()
        trial.run(luck.within(0.05, 0.4))
        rig.grip(*hand)
    live, seen = beside_dead(rig)
    trial.out.append(live)
    return ended(trial, seen)


def travel(case, seed):
    """A motion runs into the guard of its travel, with lost samples, at up to 2 rad/s."""
    trial = Trial(case, seed)
    if not trial.armed:
        return None
    speed = trial.luck.spread(0.2, 2.0)
    trial.ask(Program.SERVO, velocity_rad_s=speed * trial.luck.one(1, -1))
    trial.run(2.0 + 3.2 / speed)
    live, seen = beside_dead(trial.rig, 2.0)
    trial.out.append(live)
    words = seen.words if trial.flags & ProgramFlag.TRAVEL else (*seen.words, f"ends {trial.flags!r}")
    return ended(trial, seen._replace(words=words))


def servo(case, seed):
    """The servo of an identification on samples of which some are lost."""
    trial = Trial(case, seed)
    if not trial.armed:
        return None
    trial.ask(Program.SERVO, velocity_rad_s=trial.luck.spread(0.3, 1.0))
    trial.run(1.0)
    return ended(trial, chatter(trial, trial.run(1.0)))


def track(case, seed):
    """A reference followed by the controllers of `positioning`; some in a hand that grips and pulls."""
    luck, a = Luck(seed, 7), case.axis[0]
    amplitude = luck.one(0.03, 0.1, -0.2)
    # beside an end of the travel, as near as the reference may
    trial = Trial(case, seed, at_rad=luck.one(0.0, math.copysign(2.85 - 2 * abs(amplitude), amplitude)))
    if not trial.armed:
        return None
    rig = trial.rig
    controller, shape = luck.one("PD", "PID"), luck.one(Shape.STEP, Shape.STEP, Shape.SINE, Shape.TRIANGLE)
    moved = Track("", np.zeros((1, 3)), shape, amplitude, luck.within(1.0, 3.0))
    order = SimpleNamespace(loaded=trial.loaded)
    told = fields_of(order, controller, moved, SimpleNamespace(name="none"))
    began = float(rig.law[0]["position_rad"][0, 0])
    trial.ask(Program.TRACK, 1.5, **told)
    if luck.one(True, False, False):
        trial.run(luck.within(0.05, 0.6))
        hand = hand_of(luck)
        rig.grip(*hand, pull(luck, case, hand))
        trial.run(0.3)
        live, seen = beside_dead(rig)
        trial.out.append(live)
        return ended(trial, seen)
    trial.run(1.1)
    out = trial.run(0.35)
    # a triangle turns by a step of the torque
    seen, words = chatter(trial, out) if shape != Shape.TRIANGLE else Seen(()), []
    if shape == Shape.STEP:
        dry = (a["peak"] * (1 + a["wave"]) + a["cogging"]) / (1 - a["by_load"])
        off = abs(out[-1, PLACE] - began - moved.amplitude_rad)
        # an integral dies away by 1.6/s
        words += ["off"] * int(
            off > 1.2 * dry / told["stiffness_nm_rad"] + 2e-3 + 0.05 * abs(moved.amplitude_rad)
        )
        # to and fro: an integral may end a stick late
        ways = np.sign(out[np.abs(out[:, SPEED]) > 2e-2, SPEED])
        words += ["rings"] * int(np.count_nonzero(np.diff(ways)) >= 3)
    words += [f"ends {trial.flags!r}"] * (trial.flags not in (ProgramFlag(0), ProgramFlag.DONE))
    live, rest = beside_dead(rig, 1.5)
    trial.out.append(live)
    return ended(trial, seen._replace(words=tuple({*seen.words, *words, *rest.words})))


def hold(case, seed):
    """A renderer falls silent while a hand swings in its world; its HOLD outlasts 80 ms, with an account that
    is empty, as a deficit before it leaves it."""
    luck = Luck(seed, 2)
    hand = hand_of(luck)
    trial = Trial(case, seed, bare=False, first=hand)
    if not trial.armed:
        return None
    rig = trial.rig
    rig.law[2]["target_stop_ticks"] = 10**6
    trial.followed(0.3, 0.0)
    rig.kept[foreign_braked.REST] += hand.spring * pull(luck, case, hand)
    trial.followed(0.2, luck.within(-0.2, 0.2))
    trial.run(0.06)
    if rig.law[1]["state"][0] == State.HOLD:
        rig.law[1]["energy_port_j"] = luck.one(0.0, -0.1, -0.5) * rig.law[2]["energy_budget_j"]
    live, seen = beside_dead(rig)
    trial.out.append(live)
    return ended(trial, seen, (State.HOLD,))


def stop(case, seed):
    """STOP in a stretched world, or while the servo turns the joint."""
    turns = Luck(seed, 3).one(True, False)
    trial = Trial(case, seed, bare=turns, first=None if turns else hand_of(Luck(seed, 4)))
    if not trial.armed:
        return None
    rig = trial.rig
    if turns:
        trial.ask(Program.SERVO, velocity_rad_s=trial.luck.spread(0.2, 2.0))
        trial.run(0.5)
    else:
        trial.followed(0.5, trial.luck.within(-0.3, 0.3))
    rig.law[3]["stop_count"] += 1
    before = float(rig.law[0]["torque_applied_nm"][0, 0])
    out, words = trial.run(0.15), []
    sent = np.abs(np.concatenate([[before], out[:, SENT]]))
    words += ["late"] * int(np.any(np.diff(sent) > 1e-12) or sent[51:].max() > 0)
    live, seen = beside_dead(rig, 2.0)
    trial.out.append(live)
    return ended(trial, seen._replace(words=(*seen.words, *words)), (State.IDLE,))


def switch(case, seed):
    """The world is another one every tenth of a second while a hand pulls to and fro; silences between."""
    hand = hand_of(Luck(seed, 5))
    trial = Trial(case, seed, bare=False, first=hand)
    if not trial.armed:
        return None
    rig, luck, command = trial.rig, trial.luck, trial.rig.law[3]
    armed_s, middle = rig.time_s - 0.8, float(rig.kept[foreign_braked.REST])
    for _ in range(60):
        kind = luck.one("free", "spring", "wall", "damper", "detents", "remote", "remote")
        rig.kept[foreign_braked.REST] = middle + hand.spring * pull(luck, case, hand)
        command["compensation"] = luck.one(0.0, 1.0, 1.0)
        if kind == "remote":
            trial.followed(luck.one(0.01, 0.05), luck.within(-0.3, 0.3))
        else:
            command["environment_kind"] = int(Environment[kind.upper()])
            command["environment_stiffness_nm_rad"] = luck.spread(1, 1e5)
            command["environment_center_rad"] = luck.within(-0.3, 0.3)
        command["seq"] += 1
        trial.run(luck.within(0.02, 0.08))
    p, took = rig.law[2][0], np.cumsum(np.concatenate(trial.out)[:, TOOK])
    since = rig.time_s - armed_s - rig.period_s * np.arange(len(took) - 1, -1, -1)
    allowed = (
        p["renderer_store_j"] + p["renderer_power_w"] * np.maximum(since, 0) + 1.5 * p["energy_budget_j"]
    )
    seen = Seen(("fed",) if np.any(took > allowed) else (), fed=float((took / allowed).max()))
    # a light joint is that fast with what a world may put in
    quick = rig.fault == int(Fault.OVERSPEED).bit_length() - 1
    return ended(trial, seen, (State.ACTIVE, State.HOLD, *[State.FAULT] * quick))


def pulse(case, seed):
    """The test pulse, in a hand that swings the joint a little."""
    luck = Luck(seed, 6)
    hand, rig = hand_of(luck), Rig(case.loaded, case.axis, seed)
    rig.run(1.2)
    rig.grip(*hand, luck.one(0.0, luck.within(-0.01, 0.01)))
    parts, command = [], rig.law[3]
    command["arm_count"] += 1
    command["epoch"], command["seq"] = rig.law[1]["epoch"], command["seq"] + 1
    parts.append(rig.run(0.5))
    out = parts[0]
    arming = out[:, STATE] == State.ARMING
    if not arming.any():
        return None
    words = ["kicks"] * int(
        np.abs(out[arming, SENT]).max() > 0.05 * rig.law[2]["torque_limit_nm"][0, 0] + 1e-12
    )
    words += ["fed"] * int(
        out[arming, TOOK].sum() > 1.5 * rig.law[2]["energy_budget_j"][0] + hand.spring * 5e-5
    )
    _, rest = beside_dead(rig, 2.0)
    return rest._replace(words=(*words, *rest.words))


STATES = {
    "BRAKE": brake, "TRAVEL": travel, "SERVO": servo, "TRACK": track, "HOLD": hold, "STOP": stop,
    "SWITCH": switch, "PULSE": pulse,
}  # fmt: skip


def asked(case, seed, names=tuple(STATES)):
    """(state, Seen) of each state that could be asked; a joint without a sound servo is asked no program."""
    for name in names:
        try:
            seen = STATES[name](case, seed)
        except ConfigError:
            seen = None
        if seen is not None:
            yield name, seen


def main():
    """Print whatever is wrong, then the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--rigs", type=int, default=100)
    parser.add_argument("--only", default="")
    told = parser.parse_args()
    runs, wrong = Counter(), Counter()
    names = [name for name in STATES if told.only in name]
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(told.first, told.first + told.rigs):
            case = drawn(seed, folder)
            runs["rigs", "refused" if case.loaded is None else case.kind] += 1
            if case.loaded is None:
                continue
            for name, seen in asked(case, seed, names):
                runs[name, case.kind] += 1
                for word in seen.words:
                    wrong[name, case.kind, word.split()[0]] += 1
                if seen.words:
                    click.echo(
                        f"seed {seed} {name}: {', '.join(seen.words)}: {case.kind}, {case.friction}: left "
                        f"{1e3 * seen.left:.3g}, dead {1e3 * seen.dead:.3g}, fed {1e3 * seen.fed:.3g}"
                    )
    for (name, kind), count in sorted(runs.items()):
        words = [f"{word} {n}" for (of, on, word), n in sorted(wrong.items()) if (of, on) == (name, kind)]
        click.echo(f"{name:8} {kind:14} {count:5}  {', '.join(words)}")


if __name__ == "__main__":
    main()
