"""Seeded bugs in reading logs of other makes, and in what is said of a balance."""

from __future__ import annotations

from seed import Seed

CELLS = ("tests/unit/hw/test_cells.py",)
STRUCTURED = ("tests/unit/hw/test_structured_logs.py",)
BAGS = ("tests/unit/recording/test_joint_states.py",)
TRUTH = ("tests/unit/friction/test_truth_of_intervals.py",)
DIRT = ("tests/unit/friction/test_dirt_of_programs.py",)
CLIPPING = ("tests/unit/friction/test_clipping.py",)
SHAPE = ("tests/unit/friction/test_torque_shape.py",)
LEFT = ("tests/unit/friction/test_left_over.py",)

SEEDS = (
    Seed(
        "the temperature of a log is that of its clock, whenever that began",
        "hw/playback/reader.py",
        "return table.time_s - table.time_s[0], values",
        "return table.time_s, values",
        ("tests/unit/friction/test_temperatures.py",),
    ),
    Seed(
        "the temperature of a second log is that of its end throughout: logs follow one after the other",
        "rtctl/friction/logs/temperatures.py",
        "samples.time_s[rows] - signals.began_s(number)",
        "samples.time_s[rows]",
        ("tests/unit/friction/test_temperatures.py",),
    ),
    Seed(
        "a direction of which nothing is known is divided by its power",
        "rtctl/friction/logs/intervals.py",
        "told = power > RANK * power[-1]",
        "told = power > -np.inf",
        ("tests/unit/friction/test_truth_of_intervals.py",),
    ),
    Seed(
        "a log over midnight goes back by a day",
        "hw/playback/cells.py",
        'return Words(found + DAY_S * np.cumsum(past_midnight), "s")',
        'return Words(found, "s")',
        CELLS,
    ),
    Seed(
        "numbers in two units are one column",
        "hw/playback/cells.py",
        "if len(units) == 1 else None",
        "if units else None",
        CELLS,
    ),
    Seed(
        "a counter that starts over is continued whatever the step back",
        "hw/playback/stamps.py",
        "(over > 0).all() and (over < longest).all()",
        "(over > 0).all()",
        CELLS,
    ),
    Seed(
        "a row with a hole is passed over as if it were another topic's",
        "hw/playback/text_rows.py",
        "if given != 1:",
        "if given == len(index):",
        CELLS,
    ),
    Seed(
        "a fault below the first numbers is taken for units",
        "hw/playback/text_rows.py",
        "if not alone and not blank and (not any(words) or (any(numbers) and not (rows and headed))):",
        "if not any(words):",
        CELLS,
    ),
    Seed(
        "signals in rows are read as rows of signals",
        "hw/playback/columns.py",
        "return array.T if array.shape[0] < array.shape[1] else array",
        "return array",
        STRUCTURED,
    ),
    Seed(
        "of structures of one name the first is every one",
        "hw/playback/matlab.py",
        '_fields(f"{own}.{field}", entry[field], found, spelt, depth - 1)',
        '_fields(f"{own}.{field}", entries[0][field], found, spelt, depth - 1)',
        STRUCTURED,
    ),
    Seed(
        "a joint is where it was in the first message of a bag",
        "rtctl/recording/joint_states.py",
        "at = [state.names.index(name) for _, state in states]",
        "at = [names.index(name) for _, state in states]",
        BAGS,
    ),
    Seed(
        "doubles of a bag are not aligned",
        "rtctl/recording/joint_states.py",
        "start = self._aligned(8)",
        "start = self.at",
        BAGS,
    ),
    Seed(
        "noise is taken for a hidden torque",
        "rtctl/friction/logs/left_over.py",
        "if told > NOISE_SHARE * power else 0.0",
        "if told > 0.0 else 0.0",
        LEFT,
    ),
    Seed(
        "what is left over says nothing of the parameters",
        "rtctl/friction/logs/left_over.py",
        "found[name] = rest / max(float(own.std()) * abs(value), 1e-300)",
        "found[name] = 0.0",
        LEFT,
    ),
    Seed(
        "every motor torque is one that was held",
        "rtctl/friction/logs/regression.py",
        "    if late is None:\n        return half_period_s",
        "    if late is None or half_period_s > 0:\n        return half_period_s",
        LEFT,
    ),
    Seed(
        "every torque that looks early was measured with the position",
        "rtctl/friction/logs/regression.py",
        "if nearer or (late.high < at + half_period_s and late.holds(at)):",
        "if True:",
        LEFT,
    ),
    Seed(
        "blocks that tell most of a parameter count as all others",
        "rtctl/friction/logs/intervals.py",
        "grown = axes / np.sqrt(np.maximum(1 - share, LEAST_LEFT)) @ axes.T",
        "grown = axes @ axes.T",
        TRUTH,
    ),
    Seed(
        "a parameter that two blocks tell has the freedom of twenty",
        "rtctl/friction/logs/intervals.py",
        "return np.asarray(shares.sum(axis=0) ** 2 / np.maximum((shares**2).sum(axis=0), 1e-300))",
        "return np.full(X.shape[1], 1e9)",
        TRUTH,
    ),
    Seed(
        "a late torque leaves the inertia as it is",
        "rtctl/friction/logs/other_readings.py",
        "if late is not None and not late.holds(0.0):",
        "if late is not None and late.value > 1e9:",
        TRUTH,
    ),
    Seed(
        "a low-passed velocity is only late",
        "rtctl/friction/logs/recorded_velocity.py",
        "behind.late_s > 0 and",
        "behind.late_s > 1e9 and",
        ("tests/unit/friction/test_recorded_velocity.py",),
    ),
    Seed(
        "with one speed all friction is Coulomb's",
        "rtctl/friction/logs/even_motion.py",
        'return {"low": min(friction.low, 0.0), "high": max(friction.high, 0.0)}',
        'return {"low": friction.low, "high": friction.high}',
        ("tests/unit/friction/test_even_motion.py",),
    ),
    Seed(
        "a coasting joint is one that something else moves",
        "rtctl/friction/logs/torque_faults.py",
        "if min(forth, back) > least:",
        "if max(forth, back) > least:",
        DIRT,
    ),
    Seed(
        "a torque of a slow bus is clipped",
        "rtctl/friction/logs/clipping.py",
        "if length >= RUN and held < length - 1:",
        "if length >= RUN:",
        CLIPPING,
    ),
    Seed(
        "an even torque is one that was cut off",
        "rtctl/friction/logs/clipping.py",
        "return surely and found.short > least and found.better < BETTER",
        "return True",
        CLIPPING,
    ),
    Seed(
        "no balance contradicts a torque that was cut off",
        "rtctl/friction/logs/clipping.py",
        "return surely and found.short > least and found.better < BETTER",
        "return False",
        CLIPPING,
    ),
    Seed(
        "a gear that rubs by its torque is a larger inertia",
        "rtctl/friction/logs/torque_shape.py",
        "if known and share.sure() and",
        "if known and share.value > 1e9 and",
        SHAPE,
    ),
    Seed(
        "the share of a torque is made of the recorded one alone",
        "rtctl/friction/logs/torque_shape.py",
        "np.abs(u / (1 - k * np.sign(u * self.direction)))",
        "np.abs(u)",
        SHAPE,
    ),
    Seed(
        "every joint has a share of a torque",
        "rtctl/friction/logs/torque_shape.py",
        "abs(self.value) > SURELY * self.error",
        "abs(self.value) > 0 * self.error",
        SHAPE,
    ),
    Seed(
        "a torque that bends is in proportion",
        "rtctl/friction/logs/torque_shape.py",
        "if not found.sure():",
        "if found.sure():",
        SHAPE,
    ),
    Seed(
        "a drift of the position is one of the torque",
        "rtctl/friction/logs/torque_shape.py",
        "if together and friction[0] * motion[0] > 0:",
        "if friction[0] * motion[0] != 0:",
        SHAPE,
    ),
    Seed(
        "a velocity of which the scale drifts is right",
        "rtctl/friction/logs/recorded_velocity.py",
        "if not scales or max(scales) - min(scales) <= max(CHANGE_MAX, SURELY * math.hypot(*errors)):",
        "if not scales or max(scales) - min(scales) <= 1e9:",
        ("tests/unit/friction/test_recorded_velocity.py",),
    ),
    Seed(
        "a joint that sticks and slips is one whose position was held",
        "rtctl/friction/logs/rows_in_turn.py",
        "last - first > max(UNEVEN, UNEVEN_SHARE * times)",
        "last - first > 1000 * UNEVEN",
        DIRT,
    ),
    Seed(
        "sessions that differ are so many independent errors",
        "rtctl/friction/learn/certainty.py",
        "others, own_ones = float(t.ppf(side, max(n_blocks - 1, FREEDOM_MIN))), float(norm.ppf(side))",
        "others, own_ones = float(norm.ppf(side)), float(norm.ppf(side))",
        ("tests/unit/friction/test_bands.py",),
    ),
    Seed(
        "both directions share a curve whatever it errs",
        "rtctl/friction/learn/sharing.py",
        "return more + together.luck_nm2 - apart.luck_nm2 <= 0",
        "return True",
        ("tests/unit/friction/test_search.py",),
    ),
    Seed(
        "an interval is of chance alone",
        "rtctl/friction/logs/other_readings.py",
        "found: np.ndarray = TIMES * largest",
        "found: np.ndarray = 0.0 * largest",
        TRUTH,
    ),
    Seed(
        "the steps of a position that was resampled are not seen",
        "rtctl/friction/logs/row_noise.py",
        "return log.step_rad or quantum(log.position_rad)",
        "return quantum(log.position_rad)",
        (
            "tests/unit/friction/test_processed_logs.py"
            "::test_the_steps_of_a_position_that_was_resampled_are_those_it_was_recorded_with",
        ),
    ),
    Seed(
        "an offset that was taken out leaves the guaranteed friction as it is",
        "rtctl/friction/learn/point_evidence.py",
        "single_max_error_nm=branch.error_max_nm + doubt_nm",
        "single_max_error_nm=branch.error_max_nm",
        TRUTH,
    ),
    Seed(
        "a line that has seen the points is as blind as the model",
        "rtctl/friction/learn/report_judge.py",
        "return float(np.hypot(np.sqrt(fitted), session))",
        "return float(np.sqrt(np.mean(floor**2)))",
        TRUTH,
    ),
    Seed(
        "points slower than any that was learned from speak against a model",
        "rtctl/friction/learn/report_judge.py",
        "slow = speed < slowest * (1 - SAME_SPEED)",
        "slow = speed < 0",
        ("tests/unit/friction/test_band_of_one_log.py",),
    ),
)
