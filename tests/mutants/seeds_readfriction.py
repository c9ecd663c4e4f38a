"""Seeded bugs of a reading of friction's learning, logs and identification by somebody who knows numerics:
bounds that are off by one, times that are lopsided, sides of which only the first was asked.
"""

from __future__ import annotations

from seed import Seed

FRICTION, SIGNALS = "tests/unit/friction/test_", "tests/unit/identify/test_signals.py::test_"

SEEDS = (
    Seed(
        "a slot that the loop left out makes an acceleration of a speed",
        "rtctl/identify/tick_readings.py",
        "    square -= t * (t @ square / (t @ t))\n",
        "",
        (f"{SIGNALS}slots_left_out_near_one_end_of_a_window_make_no_acceleration_of_a_speed",),
    ),
    Seed(
        "break-away of the second direction alone weighs nothing in the model that is deployed",
        "rtctl/friction/learn/ladder.py",
        "[data.weight[data.speed == 0] for data in ladder.sides]",
        "[data.weight[data.speed == 0] for data in ladder.sides[:1]]",
        (f"{FRICTION}search.py::test_break_away_of_one_direction_alone_weighs_as_much_in_what_is_deployed",),
    ),
    Seed(
        "a motion of just three laps is none that repeats itself",
        "rtctl/friction/learn/laps.py",
        "n // LAPS_MIN + 2",
        "n // LAPS_MIN",
        (
            f"{FRICTION}honest_scoring.py::test_laps_of_a_motion_that_repeats_itself_are_found_and_held_out_whole",
        ),
    ),
    Seed(
        "places whose speeds differ by noise have speeds enough to hold some out",
        "rtctl/friction/learn/places.py",
        "len(level_starts(one.v)) >= _SPEEDS_LEAST",
        "len(np.unique(one.v)) >= _SPEEDS_LEAST",
        (f"{FRICTION}learn_places.py::test_speeds_that_differ_by_noise_alone_are_not_held_out_by_speed",),
    ),
    Seed(
        "a load that one session alone has ends a fit in a traceback",
        "rtctl/friction/learn/beside_speed.py",
        "    if len(np.unique(fold)) < 2:\n",
        "    if not len(fold):\n",
        (f"{FRICTION}load.py::test_a_load_that_one_session_alone_has_is_not_judged_by_it",),
    ),
    Seed(
        "a torque of several rates together has the delay of none",
        "rtctl/friction/logs/log_points.py",
        "if stretches[0].rate_hz < ONE_RATE * slowest_hz]",
        "if stretches[0].rate_hz > 0]",
        (f"{FRICTION}log_input.py::test_commands_of_two_rates_are_each_held_for_a_period_of_their_own",),
    ),
    Seed(
        "each log is put back by the half period of the first",
        "rtctl/friction/logs/log_points.py",
        "for one in half_s]",
        "for one in half_s[:1] * len(half_s)]",
        (f"{FRICTION}log_input.py::test_commands_of_two_rates_are_each_held_for_a_period_of_their_own",),
    ),
    Seed(
        "a loop that runs off the numbers has no growth, and a maximum passes it over",
        "rtctl/experiments/worst_hand.py",
        "    return float(last / half) if last < np.inf else np.inf\n",
        "    return float(last / half)\n",
        ("tests/unit/experiments/test_positioning.py::test_a_loop_that_runs_off_the_numbers_grows",),
    ),
    Seed(
        "an acceleration of three points makes the inertia of a slow log too large",
        "rtctl/friction/logs/dynamics.py",
        "derivatives(smooth(log.position_rad, log.rate_hz, cutoff_hz), step)",
        "(v := np.gradient(smooth(log.position_rad, log.rate_hz, cutoff_hz), step)), np.gradient(v, step)",
        (f"{FRICTION}logs.py::test_the_inertia_of_a_log_of_a_low_rate_is_right_in_quick_motion",),
    ),
)
