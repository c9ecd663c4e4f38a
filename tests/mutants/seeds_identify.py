"""Seeded bugs of identification: presliding length, places, ripple, speeds that do not become steady."""

from __future__ import annotations

from seed import Seed

MEMORY = ("tests/unit/friction/test_reversal_memory.py",)
IN_LOGS = ("tests/unit/friction/test_presliding_in_logs.py",)
PRESLIDING = ("tests/unit/friction/test_presliding.py",)
EVIDENCE = ("tests/unit/friction/test_point_evidence.py",)
DIRTY = ("tests/unit/friction/test_dirty_logs.py",)
SCORING = "tests/unit/friction/test_honest_scoring.py"
BOUND = (f"{SCORING}::test_the_bound_knows_the_test_points",)
SCALES = (f"{SCORING}::test_no_held_out_point_sets_the_scales_of_its_own_fold",)
BLOCKS = (
    f"{SCORING}"
    "::test_the_standard_error_by_blocks_is_that_of_repeated_draws_and_that_of_single_errors_is_not",
)
CHOICE = ("tests/unit/friction/test_selection.py",)
MEAN = ("tests/unit/friction/test_mean.py",)
FORETOLD = ("tests/unit/friction/test_foretold.py",)
GIVEN_UP = ("tests/unit/friction/test_given_up.py",)
HARD = "tests/unit/identify/test_difficult_joints.py"
LIGHT = "tests/unit/identify/test_light_joint.py"

SEEDS = (
    Seed(
        "a session is foretold by itself and those before it",
        "rtctl/friction/learn/foretold.py",
        "kept = data.session < at",
        "kept = data.session <= at",
        FORETOLD,
    ),
    Seed(
        "the band does not know that friction wears on",
        "rtctl/friction/learn/bands.py",
        "if ahead is not None and ahead.rmse_nm > held_out.rmse_nm > 0:",
        "if ahead is not None and ahead.rmse_nm > 1e9 + held_out.rmse_nm:",
        FORETOLD,
    ),
    Seed(
        "what sessions differ by is noise",
        "rtctl/friction/learn/search.py",
        "block, block, level, between)",
        "block, None, level, between)",
        MEAN,
    ),
    Seed(
        "a rung weighs by what it was lucky to err",
        "rtctl/friction/learn/mean.py",
        "expected = np.array([rung.compared_nm for rung in rungs])",
        "expected = np.array([rung.rmse_nm for rung in rungs])",
        MEAN,
    ),
    Seed(
        "the mean is taken where errors count as equal, too",
        "rtctl/friction/learn/ladder.py",
        "if one.compared_nm <= equal_nm:",
        "if one.expected_nm < 0:",
        MEAN,
    ),
    Seed(
        "the table of a mean has no knot where a spline in it bends",
        "rtctl/friction/kind_mean.py",
        "found.append(part.of.breaks(part) if exact is None else exact.knots)",
        "found.append(part.of.breaks(part))",
        MEAN,
    ),
    Seed(
        "the shares of a mean in a file are not held to 1",
        "rtctl/friction/mean_document.py",
        "SHARES_OFF = 1e-9",
        "SHARES_OFF = 1.0",
        MEAN,
    ),
    Seed(
        "a candidate is lost when LIBSVM gives one fold up",
        "rtctl/friction/learn/machines.py",
        "if found is not None and (found.converged or max_iterations < MAX_ITERATIONS):",
        "if found is not None:",
        GIVEN_UP,
    ),
    Seed(
        "what moves the inertia when a slide is seen is break-away",
        "rtctl/identify/tick_readings.py",
        'np.full(n, 1.0 / n), "valid") - inertia_kgm2 * acceleration',
        'np.full(n, 1.0 / n), "valid")',
        ("tests/unit/identify/test_signals.py",),
    ),
    Seed(
        "what passes where most jumps is kept when another servo is tried",
        "rtctl/identify/collected.py",
        "        self.measurements.clear()\n",
        "",
        (f"{LIGHT}::test_what_passes_where_most_jumps_is_no_sample_of_the_friction",),
    ),
    Seed(
        "few fast speeds leave the viscous slope to the Stribeck peak",
        "rtctl/friction/learn/fit.py",
        "level_starts(speed)[-4:][0])",
        "level_starts(speed)[0])",
        ("tests/unit/friction/test_learning.py",),
    ),
    Seed(
        "what damping takes when a slow slide is seen is break-away",
        "rtctl/identify/tick_readings.py",
        "max(look_back, seen - rows_before_seen(position_rad, seen, look_back))",
        "seen",
        ("tests/unit/identify/test_signals.py",),
    ),
    Seed(
        "bristles that soften make the presliding length longer",
        "rtctl/friction/presliding.py",
        "curve = ramp.share + bend * _softening(ramp.share)",
        "curve = ramp.share",
        PRESLIDING,
    ),
    Seed(
        "bristles never slide in a log",
        "rtctl/friction/logs/turns.py",
        "found[row] = saturate(found[row - 1] + (path_rad[row] - path_rad[row - 1]) / length_rad)",
        "found[row] = found[row - 1] + (path_rad[row] - path_rad[row - 1]) / length_rad",
        IN_LOGS,
    ),
    Seed(
        "the doubt about a length from turns is left out",
        "rtctl/friction/logs/presliding_in_logs.py",
        "worse = left > (1 + SURE**2 / turns) * left[best]",
        "worse = left > left[best]",
        IN_LOGS,
    ),
    Seed(
        "a joint that stands is taken for one that slides",
        "rtctl/friction/logs/turns.py",
        "kept = window >= speed_min_rad_s / cutoff_hz",
        "kept = window >= 0.0",
        IN_LOGS,
    ),
    Seed(
        "memory of a turn is judged on the rows that it was fitted to",
        "rtctl/friction/logs/reversal_memory.py",
        "return (odd, ~odd), (~odd, odd)",
        "return (odd, odd), (~odd, ~odd)",
        MEMORY,
    ),
    Seed(
        "a stretch beside another has no offset of its own near turns",
        "rtctl/friction/logs/reversal_memory.py",
        "offsets = np.repeat(np.eye(len(parts)), [len(part.rows) for part in parts], axis=0)",
        "offsets = np.ones((sum(len(part.rows) for part in parts), 1))",
        MEMORY,
    ),
    Seed(
        "the spread of two groups forgets how far apart they are",
        "rtctl/friction/presliding.py",
        "(within + n @ np.square(each - length))",
        "within",
        PRESLIDING,
    ),
    Seed(
        "a length by hand gives way to the measured one",
        "rtctl/friction/learn/point_evidence.py",
        "if presliding_rad is not None else presliding_of(points)",
        "if False else presliding_of(points)",
        EVIDENCE,
    ),
    Seed(
        "the strongest place counts",
        "rtctl/friction/learn/point_evidence.py",
        "shortfall = model.magnitude(_signed_speed(points)) - points.direction * weakest",
        "shortfall = points.direction * weakest - model.magnitude(_signed_speed(points))",
        EVIDENCE,
    ),
    Seed(
        "stick-slip with the right mean speed is steady",
        "rtctl/identify/tick_readings.py",
        "np.all(off <= (UNEVEN_SHARE",
        "np.any(off <= (UNEVEN_SHARE",
        (f"{HARD}::test_stick_slip_is_not_steady_whatever_the_mean",),
    ),
    Seed(
        "a joint that jumps from count to count moves steadily",
        "rtctl/identify/tick_readings.py",
        "< REST_RMS * abs(speed_rad_s)",
        "< 100.0 * abs(speed_rad_s)",
        (f"{LIGHT}::test_a_torque_that_brings_the_joint_to_rest_between_is_told",),
    ),
    Seed(
        "a drift over whole periods of a ripple is not seen",
        "rtctl/identify/tick_readings.py",
        "2.0 * float(np.mean(change)), error",
        "0.0, error",
        (f"{HARD}::test_a_ripple_is_no_drift_over_whole_periods_and_a_drift_is_one_all_the_same",),
    ),
    Seed(
        "a lower speed that was given up is asked for for ever",
        "rtctl/identify/measurement_order.py",
        "if todo := [task for task in pair if not is_over(task)]:",
        "if todo := pair:",
        (f"{HARD}::test_lower_speeds_are_asked_for_only_while_friction_rises_towards_them",),
    ),
    Seed(
        "windows of a place are no whole periods",
        "rtctl/identify/ripple.py",
        "/ self.period_rad + 0.5)",
        "/ self.period_rad + 0.5) + 0.3",
        (f"{HARD}::test_windows_of_one_place_are_whole_periods_of_the_ripple_where_they_are_long_enough",),
    ),
    Seed(
        "a jump of the position is bridged the wrong way round",
        "rtctl/friction/logs/row_faults.py",
        "rows.position_rad[jump.row + 1 :] -= jump.size_rad",
        "rows.position_rad[jump.row + 1 :] += jump.size_rad",
        DIRTY,
    ),
    Seed(
        "rows pushed in between are taken for rows that were held",
        "rtctl/friction/logs/row_faults.py",
        "    if catches_up < 1.5:",
        "    if catches_up < 0.5:",
        DIRTY,
    ),
    Seed(
        "a turned sign of one of two torques is not looked at",
        "rtctl/friction/logs/balance_faults.py",
        "if abs(weight - 1) < 0.15 or",
        "if abs(abs(weight) - 1) < 0.15 or",
        DIRTY,
    ),
    Seed(
        "a torque that stays where the motion wants more is let through",
        "rtctl/friction/logs/clipping.py",
        "FLAT_SLOPE = 0.5",
        "FLAT_SLOPE = -1.0",
        DIRTY,
    ),
    Seed(
        "what is held out sets the scale of C",
        "rtctl/friction/learn/search.py",
        "        in_scale_of(candidate, data.speed, data.friction_nm, kept, data.session),",
        "        candidate,",
        SCALES,
    ),
    Seed(
        "errors of one lap count one by one",
        "rtctl/friction/learn/certainty.py",
        "np.arange(len(values)) if blocks is None else blocks",
        "np.arange(len(values))",
        BLOCKS,
    ),
    Seed(
        "the luckiest of many machines is believed",
        "rtctl/friction/learn/selection.py",
        "return max(0.0, (float(np.sum(chosen.compared**2)) - least) / len(fold))",
        "return 0.0",
        CHOICE,
    ),
    Seed(
        "what a sparse curve errs more is taken for luck",
        "rtctl/friction/learn/selection.py",
        "among_equals = near[0].compared_nm <= equal_nm",
        "among_equals = False",
        CHOICE,
    ),
    Seed(
        "rungs are compared by either error alone",
        "rtctl/friction/learn/selection.py",
        "if len(rung.compared) != len(best.compared):",
        "if True:",
        CHOICE,
    ),
    Seed(
        "the fastest point of a session held out trains",
        "rtctl/friction/learn/nested.py",
        "np.isin(unit, unit[fold == k])",
        "fold == k",
        ("tests/unit/friction/test_nested.py",),
    ),
    Seed(
        "a zero that is off goes into friction points unseen",
        "rtctl/friction/logs/points_check.py",
        "if share > UNEQUAL:",
        "if False:",
        ("tests/unit/friction/test_points_check.py",),
    ),
    Seed(
        "a scope's volts are taken for radians",
        "hw/playback/text_table.py",
        "if _SAYS_UNITS.match(line)",
        "if False",
        ("tests/unit/hw/test_log_formats.py",),
    ),
    Seed(
        "the bound of a model forgets its test points",
        "rtctl/friction/model.py",
        "beside = (self.test_max_error_nm or 0.0, self.single_max_error_nm or 0.0, band_nm)",
        "beside = (0.0, self.single_max_error_nm or 0.0, band_nm)",
        BOUND,
    ),
)
