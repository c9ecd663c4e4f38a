"""Free motion with and without compensation (Bi, Figs. 6 and 7): the same wish, and the same path."""

from __future__ import annotations

from typing import Any

import numpy as np

from hw.motion import own_size
from rtctl.experiments import figures, same_path, virtual
from rtctl.experiments.order import Order
from rtctl.experiments.report import Outcome, Part, Target
from rtctl.experiments.same_path import Way
from rtctl.experiments.seeds import figures_over_seeds
from rtctl.experiments.statistics import Estimate, estimate, reduction, rms
from rtctl.experiments.virtual import FAST_SINE, SLOW_TRIANGLE, Motion, Run, Variant, both, with_feedback
from rtctl.friction.learn.report_page import Picture
from rtctl.friction.learn.report_tables import Table

TITLE = "Free motion"
STRONG_GAIN, STRONG_VISCOUS = 0.97, 0.2
LOW, HIGH = 0.75, 1.25
HUNTS_RAD_S = 1e-3
"""A joint that was let go hunts or runs above this speed."""

TOO_LOW, TOO_HIGH = virtual.with_model_scaled(LOW), virtual.with_model_scaled(HIGH)
NO_OBSERVER = virtual.with_observer(0.0)
OFF = Variant("off", 0.0)
ON = Variant("default")
"""As the rig file says: the learned feed-forward, and the disturbance observer on what it leaves."""
ALONE = Variant("feed-forward alone", 1.0, NO_OBSERVER)
FEEDBACK = Variant("default + force feedback", 1.0, with_feedback)
LOW_MODEL = Variant("model 25 % too low", 1.0, TOO_LOW)
LOW_ALONE = Variant("feed-forward alone, model 25 % too low", 1.0, both(TOO_LOW, NO_OBSERVER))
HIGH_MODEL = Variant("model 25 % too high", 1.0, TOO_HIGH)
STRONG = virtual.with_gain(STRONG_GAIN, STRONG_VISCOUS)

VARIANTS = (
    OFF,
    ON,
    ALONE,
    Variant("default, force low-pass", 1.0, virtual.with_force_lowpass),
    FEEDBACK,
    Variant("feed-forward alone + force feedback", 1.0, both(NO_OBSERVER, with_feedback)),
    Variant("default + force feedback, force low-pass", 1.0, both(virtual.with_force_lowpass, with_feedback)),
    Variant("force feedback alone", 1.0, both(virtual.with_gain(0.0), NO_OBSERVER, with_feedback)),
    LOW_MODEL,
    LOW_ALONE,
    Variant("model 25 % too low + force feedback", 1.0, both(TOO_LOW, with_feedback)),
    HIGH_MODEL,
    Variant("model 25 % too high + force feedback", 1.0, both(TOO_HIGH, with_feedback)),
    Variant("strong feed-forward + observer", 1.0, STRONG),
    Variant("strong feed-forward + observer, model 25 % too low", 1.0, both(STRONG, TOO_LOW)),
)  # fmt: skip
MOTIONS = (FAST_SINE, SLOW_TRIANGLE)

Measured = dict[str, dict[str, np.ndarray]]
"""Variant -> figure -> one value per seed."""


def run(order: Order) -> Outcome:
    """Run the experiment on the simulated rig.

    Raises
    ------
    ConfigError, DataError
        Not a simulated rig; or a run that was stopped by a fault."""
    order.require_simulated("free-motion --simulate")
    per_motion = 1 / (len(MOTIONS) + 0.3)  # .3: hands off, pictures and the same path
    found = {
        motion.name: _measure(order, motion, at * per_motion, per_motion) for at, motion in enumerate(MOTIONS)
    }
    released = _released(order, len(MOTIONS) * per_motion)
    pictures = [_picture(order, motion) for motion in MOTIONS]  # of seed 0
    ways = {motion.name: same_path.compare(order, motion) for motion in MOTIONS}
    order.progress(1.0, "free motion")
    return _outcome(order, found, released, pictures, ways)


def _measure(order: Order, motion: Motion, start: float, share: float) -> Measured:
    found: Measured = {}
    for at, variant in enumerate(VARIANTS):
        order.progress(start + share * at / len(VARIANTS), f"{motion.name}: {variant.name}")

        def once(order: Order, seed: int, variant: Variant = variant) -> dict[str, float]:
            return figures_of(virtual.measure(order.loaded, seed, motion, variant))

        found[variant.name] = figures_over_seeds(order, once)
    return found


def figures_of(run: Run) -> dict[str, float]:
    """Figures of one run: true and sensed torque of the hand, least energies (N m, J)."""
    hand = run.truth["hand_torque_nm"][:, 0]  # the true one: noise is felt by nobody
    return {
        "hand_rms_nm": rms(hand),
        "sensor_rms_nm": rms(run.trace["hand_torque_nm"][:, 0]),
        "hand_max_nm": float(np.abs(hand).max()),
        "hand_energy_min_j": virtual.hand_energy_min_j(run),
        "port_energy_min_j": float(run.trace["energy_port_j"].min()),
    }


def _released(order: Order, start: float) -> dict[str, Estimate]:
    found = {}
    for variant in VARIANTS:
        order.progress(start, f"hands off: {variant.name}")
        found[variant.name] = estimate(virtual.speeds_after_release(order, variant))
    return found


def _picture(order: Order, motion: Motion) -> Picture:
    shown = {
        variant.name: virtual.measure(order.loaded, 0, motion, variant) for variant in (OFF, ON, FEEDBACK)
    }
    first = next(iter(shown.values()))  # all have as many ticks
    time_s = np.arange(len(first.trace)) * order.loaded.config.period_s
    # two periods: the second shows that the first was no start
    end = time_s <= 2 * motion.period_s
    force = {name: (time_s[end], run.truth["hand_torque_nm"][end, 0]) for name, run in shown.items()}
    place = {
        name: (time_s[end], run.truth["position_rad"][end, 0] - run.truth["position_rad"][:, 0].mean())
        for name, run in shown.items()
    }
    return Picture(
        f"free_motion_{motion.name.replace(' ', '_')}",
        f"{motion.name}: torque of the hand on the joint in N m, and position in rad about its mean, over "
        "time in s; the same wanted motion of the hand each time (Bi, Figs. 6 and 7). Seed 0.",
        figures.stacked([("hand torque [N m]", force), ("position [rad]", place)], order.motion),
    )


def reductions(found: Measured, name: str) -> dict[str, Estimate]:
    """Reduction of a figure against "off", per variant, 0 to 1."""
    return {variant: reduction(found[OFF.name][name], one[name]) for variant, one in found.items()}


def _table(order: Order, motion: Motion, found: Measured) -> Table:
    lever_m = float(np.linalg.norm(order.loaded.config.axis[0].lever_m))  # 1 on a carriage
    less, sensed = reductions(found, "hand_rms_nm"), reductions(found, "sensor_rms_nm")
    rows = []
    for name, one in found.items():
        rows.append(
            (
                name,
                estimate(one["hand_rms_nm"]).text(1e3, ".1f"),
                estimate(one["hand_rms_nm"]).text(1 / lever_m),
                estimate(one["hand_max_nm"]).text(1e3, ".0f"),
                "-" if name == OFF.name else less[name].text(100, ".1f"),
                "-" if name == OFF.name else sensed[name].text(100, ".1f"),
                f"{1e3 * one['hand_energy_min_j'].min():.3f}",
                f"{1e3 * one['port_energy_min_j'].min():.2f}",
            )
        )
    header = (
        "controller",
        "RMS torque of the hand, mN m",
        "at the tip, N",
        "largest, mN m",
        "reduction, %",
        "as the sensor sees it, %",
        "least energy of the hand, mJ",
        "least energy of the port, mJ",
    )
    caption = (
        f"{motion.name}: mean over {order.seeds} seeds ± half of the 95 % confidence interval. Least "
        "energies are the worst of all seeds: below 0 the hand would have been fed."
    )
    return Table(caption, header, rows)


def _targets(
    found: dict[str, Measured], released: dict[str, Estimate], most_rad_s: float
) -> tuple[Target, ...]:
    fast, slow = (reductions(found[motion.name], "hand_rms_nm") for motion in MOTIONS)
    low = LOW_MODEL.name
    targets = [
        Target("fast sine: RMS torque of the hand less by", fast[ON.name], 0.76),
        Target("slow triangle: RMS torque of the hand less by", slow[ON.name], 0.83),
        Target("fast sine, model 25 % too low: less by", fast[low], 0.60),
        Target("slow triangle, model 25 % too low: less by", slow[low], 0.60),
        Target("fast sine with local force feedback: less by", fast[FEEDBACK.name], 0.88),
        Target("slow triangle with local force feedback: less by", slow[FEEDBACK.name], 0.88),
    ]
    # the worst of all seeds: a mean would hide a hand that was fed; this model may drive a joint by itself
    worst_j = min(float(one[HIGH_MODEL.name]["hand_energy_min_j"].min()) for one in found.values())
    return (
        *targets,
        Target("model 25 % too high: least energy of the hand, worst seed", estimate([worst_j]), -1e-6, "mJ",
            1e3),
        Target(
            "model 25 % too high: speed left when the hand has let go",
            released[HIGH_MODEL.name], most_rad_s, "mrad/s", 1e3, at_most=True,
        ),
    )  # fmt: skip


def _outcome(
    order: Order,
    found: dict[str, Measured],
    released: dict[str, Estimate],
    pictures: list[Picture],
    ways: dict[str, dict[str, Way]],
) -> Outcome:
    shown: list[Table | Picture] = [*pictures, _bars(order, found)]
    tables = [_table(order, motion, found[motion.name]) for motion in MOTIONS]  # units: by `report`
    most_rad_s = own_size("speed_rad_s", HUNTS_RAD_S, order.motion)
    return Outcome(
        "free-motion",
        TITLE,
        _sentence(found, ways),
        (
            Part("The same hand, three controllers", shown=tuple(shown)),
            Part("The same hand or the same path", shown=(same_path.table(ways, order.motion),)),
            Part("Every controller", (_explanation(found),), tuple(tables)),
            Part("Without a hand", shown=(_hands_off(released, most_rad_s),)),
        ),
        _targets(found, released, most_rad_s),
        _numbers(found, released, ways),
    )


def _sentence(found: dict[str, Measured], ways: dict[str, dict[str, Way]]) -> str:
    """What came out, in one sentence for each question."""
    fast, slow = (reductions(found[motion.name], "hand_rms_nm") for motion in MOTIONS)
    return (
        f"Moving the joint freely costs the hand {fast[ON.name].text(100, '.1f')} % (fast sine) and "
        f"{slow[ON.name].text(100, '.1f')} % (slow triangle) less torque with the friction compensation "
        "than without, when it wishes the same; with the learned feed-forward alone "
        f"{fast[ALONE.name].text(100, '.1f')} % and {slow[ALONE.name].text(100, '.1f')} %; with local force "
        f"feedback on top {fast[FEEDBACK.name].text(100, '.1f')} % and "
        f"{slow[FEEDBACK.name].text(100, '.1f')} %. {_paths(ways)}"
    )


def _bars(order: Order, found: dict[str, Measured]) -> Picture:
    """What each controller saves of the hand's torque."""
    bars = {motion.name: reductions(found[motion.name], "hand_rms_nm") for motion in MOTIONS}
    bars = {name: {v: e for v, e in one.items() if v != OFF.name} for name, one in bars.items()}  # saves none
    return Picture(
        "free_motion_reduction",
        "Reduction of the RMS torque of the hand against no compensation, %, with 95 % confidence intervals.",
        figures.bars(bars, "reduction [%]", order.motion, 100),
    )


def _hands_off(released: dict[str, Estimate], most_rad_s: float) -> Table:
    return Table(
        "Hands off: RMS speed 1 to 5 s after the hand let go of the joint at full speed, mean over the "
        f"seeds ± half of the 95 % confidence interval; above {1e3 * most_rad_s:g} mrad/s it hunts or runs.",
        ("controller", "speed, mrad/s"),
        tuple((name, speed.text(1e3, ".2g")) for name, speed in released.items()),
    )


def _numbers(
    found: dict[str, Measured], released: dict[str, Estimate], ways: dict[str, dict[str, Way]]
) -> dict[str, Any]:
    """Every figure, for the JSON file beside the report."""
    return {
        "motions": {
            name: {
                variant: {
                    **{figure: estimate(values) for figure, values in one.items()},
                    "reduction": reductions(measured, "hand_rms_nm")[variant],
                    "speed_after_release_rad_s": released[variant],
                }
                for variant, one in measured.items()
            }
            for name, measured in found.items()
        },
        "same_hand_or_same_path": {
            motion: {name: vars(way) for name, way in of.items()} for motion, of in ways.items()
        },
    }


def _paths(ways: dict[str, dict[str, Way]]) -> str:
    """How far the paths of the same hand differ, and what is saved along the same one."""
    hand, path = ([ways[motion.name][way] for motion in MOTIONS] for way in ("same hand", "same path"))
    differ = " and ".join(one.path.text(100, ".0f") for one in hand)
    saved = " and ".join(one.reduction.text(100, ".1f") for one in path)
    return f"Its path then differs by {differ} %; a stiff hand, led along the same path, saves {saved} %."


def _explanation(found: dict[str, Measured]) -> str:
    less = [reductions(found[motion.name], "hand_rms_nm") for motion in MOTIONS]
    alone, with_observer = (
        " and ".join(one[variant.name].text(100, ".1f") for one in less) for variant in (LOW_ALONE, LOW_MODEL)
    )
    return (
        "The torque of the hand is the true one of the simulated rig; the column beside it is what its "
        "noisy, quantised sensor saw. 'Default' is the rig file's: the learned feed-forward, and the "
        "disturbance observer on the friction it leaves. Neither takes the viscous part that the coupling "
        f"lives on, nor inertia; 'strong' is gain {STRONG_GAIN} and viscous_gain {STRONG_VISCOUS}, near the "
        "most that `rtctl check` passes on the shipped rig. With the feed-forward alone a model that is "
        "too low by a quarter takes a quarter of the help away: of dry friction F_c 1 - .75 gain stays, "
        f"beside b v and J a. That saves {alone} %; with the observer, which sees the friction that is, "
        f"it is {with_observer} % ({' and '.join(motion.name for motion in MOTIONS)})."
    )
