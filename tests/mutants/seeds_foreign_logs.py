"""Seeded bugs in what is told of logs of other makes: clocks, buses, rig files, MATLAB files of version
7.3.
"""

# longer than 300 lines: one table, a row for each seed

from __future__ import annotations

from seed import Seed

TORQUES = ("tests/unit/friction/test_torque_faults.py",)
DIRT = ("tests/unit/friction/test_dirt_of_programs.py",)
COMMANDS = ("tests/unit/friction/test_labs_commands.py",)
STAMPS = ("tests/unit/hw/test_playback_stamps.py",)
UNITS = ("tests/unit/hw/test_units_said.py",)
PLAUSIBLE = ("tests/unit/friction/test_plausibility.py",)
LAYOUTS = ("tests/unit/hw/test_other_layouts.py",)
HDF = ("tests/unit/hw/test_matlab_hdf.py",)

DIRTY = ("tests/unit/friction/test_dirty_logs.py",)
CELLS = ("tests/unit/hw/test_cells.py",)
LOOPS = "tests/unit/friction/test_foreign_clocks.py"
JUDGED = ("tests/unit/cli/test_fit_judge.py",)

SEEDS = (
    Seed(
        "a delay that changes nothing is a warning",
        "rtctl/friction/logs/regression.py",
        "if _moved_by(signals, late.value) < TOLD_CHANGE:",
        "if False:",
        (f"{LOOPS}::test_what_a_loggers_convention_explains_is_no_warning",),
    ),
    Seed(
        "a delay that changes friction by a quarter is none",
        "rtctl/friction/logs/regression.py",
        "if _moved_by(signals, late.value) < TOLD_CHANGE:",
        "if _moved_by(signals, late.value) < 4 * TOLD_CHANGE:",
        (f"{LOOPS}::test_a_torque_truly_of_another_time_is_told",),
    ),
    Seed(
        "how a torque was taken is a warning",
        "rtctl/friction/logs/log_points.py",
        "tuple(delays_s), told, taken,",
        "tuple(delays_s), (*told, *taken), (),",
        (f"{LOOPS}::test_how_the_torque_was_taken_stands_beside_the_warnings",),
    ),
    Seed(
        "logs of two loads are no cause that has a name",
        "rtctl/friction/logs/changed_within.py",
        "return _changed_between(balance, plain)",
        "return None",
        ("tests/unit/friction/test_other_makes.py",),
    ),
    Seed(
        "a Japanese dot between N and m makes no unit",
        "hw/playback/units.py",
        "⋅×・･∙•",
        "⋅×",
        UNITS,
    ),
    Seed(
        "a unit in the header is asked for all the same",
        "hw/playback/units.py",
        'return bool(said_unit(name, row) or said_unit(bare, "")) or bare',
        "return bare",
        ("tests/unit/cli/test_identify_log_of_a_linear_axis.py",),
    ),
    Seed(
        "a table of another code page than Western Windows' is none",
        "hw/playback/columns.py",
        'CODE_PAGES = ("cp1252", "cp932", "gb18030", "cp1251", "latin-1")',
        'CODE_PAGES = ("cp1252", "latin-1")',
        LAYOUTS,
    ),
    Seed(
        "a servo's strokes at one speed are a torque that assists",
        "rtctl/friction/logs/regression.py",
        'if fit.parameters["coulomb_nm"].high < 0 < _usual_friction(fit, signals):',
        "if False:",
        ("tests/unit/friction/test_even_motion.py",),
    ),
    Seed(
        "a torque turned in sign at one speed is one that is missing",
        "rtctl/friction/logs/regression.py",
        " or (inertia and inertia.high < 0 and friction < 0)",
        "",
        ("tests/unit/friction/test_even_motion.py",),
    ),
    Seed(
        "the band of one log knows its points by their neighbours in speed alone",
        "rtctl/friction/learn/bands.py",
        "np.hypot(error_nm, apart[rows][data.fold != TRAINS])",
        "np.hypot(error_nm, 0 * apart[rows][data.fold != TRAINS])",
        ("tests/unit/friction/test_band_of_one_log.py",),
    ),
    Seed(
        "the offset's drift is found beside Coulomb + viscous friction",
        "rtctl/friction/logs/offsets.py",
        "np.linspace(0, 1, BENDS + 1)",
        "np.linspace(0, 1, 2)",
        ("tests/unit/friction/test_session_offsets.py",),
    ),
    Seed(
        "parts of other speeds are parts of other friction",
        "rtctl/friction/logs/balance_faults.py",
        "if own > TOLD_RATIO * balance.fit(added=bends, rows=rows).rest:",
        "if own < 0:",
        ("tests/unit/friction/test_other_makes.py",),
    ),
    Seed(
        "friction that grows with the square of speed is a sensor that bends",
        "rtctl/friction/logs/torque_shape.py",
        "return rest < min(EXPLAINS_MUCH * self.coefficient(none)[2], over_speed)",
        "return rest > 0",
        ("tests/unit/friction/test_torque_shape.py",),
    ),
    Seed(
        "a scale that drifts explains little and is told",
        "rtctl/friction/logs/torque_shape.py",
        "if not plain.is_explained(motion[2]):",
        "if motion[2] < 0:",
        ("tests/unit/friction/test_torque_shape.py",),
    ),
    Seed(
        "long bristles are taken for sliding",
        "rtctl/friction/logs/log_points.py",
        "far = SETTLE_LENGTHS * bent.length_rad",
        "far = 0.0",
        ("tests/unit/friction/test_other_makes.py",),
    ),
    Seed(
        "an archive of several logs is its first one",
        "hw/playback/packed.py",
        "if len(files) != 1:",
        "if not files:",
        ("tests/unit/hw/test_packed_logs.py",),
    ),
    Seed(
        "an AC-coupled torque is none",
        "rtctl/friction/logs/high_passed.py",
        "if not (corner > 0 and",
        "if not (corner < 0 and",
        DIRTY,
    ),
    Seed(
        "a log that changes at one time is one",
        "rtctl/friction/logs/changed_within.py",
        "if zero.rest < ALIKE * whole.rest:",
        "if zero.rest < 0:",
        DIRTY,
    ),
    Seed(
        "a position that loses counts at speed is sound",
        "rtctl/friction/logs/lost_counts.py",
        "fits[best].rest > BETTER * bent.rest",
        "fits[best].rest > 0 * bent.rest",
        DIRTY,
    ),
    Seed(
        "a velocity is filtered once",
        "rtctl/friction/logs/recorded_velocity.py",
        "((1, 1.0), (2, MORE_REST))",
        "((1, 1.0),)",
        DIRTY,
    ),
    Seed(
        "settings that name the columns are the header",
        "hw/playback/text_table.py",
        "if line.lstrip().startswith(COMMENTS):\n        return False",
        "if line.lstrip().startswith(COMMENTS):\n        return True",
        CELLS,
    ),
    Seed(
        "a point of a new session must lie within the largest error of the old one",
        "rtctl/friction/learn/report_judge.py",
        "FAR_OVER = 2.0",
        "FAR_OVER = 1.0",
        JUDGED,
    ),
    Seed(
        "two clocks are never looked for",
        "rtctl/friction/logs/late_torques.py",
        "if left(first_s, last_s) < CLOCKS_BETTER * left(delay, delay) and _sound(two):",
        "if left(first_s, last_s) < 0 and _sound(two):",
        DIRT,
    ),
    Seed(
        "a torque of a slower bus is taken as new in every row",
        "rtctl/friction/logs/rows_in_turn.py",
        "if times < HELD_MIN or",
        "if times < 1000 * HELD_MIN or",
        DIRT,
    ),
    Seed(
        "an inertia that the log surely contradicts stands in the rig file",
        "rtctl/friction/logs/against_rig.py",
        "far > INERTIA_SURELY and not inertia.holds(axis.inertia_kgm2)",
        "far > 10 * INERTIA_SURELY and not inertia.holds(axis.inertia_kgm2)",
        PLAUSIBLE,
    ),
    Seed(
        "an inertia that the log does not contradict is told all the same",
        "rtctl/friction/logs/against_rig.py",
        "far > INERTIA_SURELY and not inertia.holds(axis.inertia_kgm2)",
        "far > INERTIA_SURELY",
        PLAUSIBLE,
    ),
    Seed(
        "seconds of single precision are taken as they are written",
        "hw/playback/stamps.py",
        "if coarsest > decimal and",
        "if coarsest < 0 and",
        STAMPS,
    ),
    Seed(
        "one unit of rounding hides a lost row",
        "hw/playback/stamps.py",
        "ROUNDED_STEP = 1.01",
        "ROUNDED_STEP = 0.5",
        STAMPS,
    ),
    Seed(
        "a unit of two words is none",
        "hw/playback/units.py",
        "if len(words) == 2 else",
        "if len(words) == 9 else",
        UNITS,
    ),
    Seed(
        "a hundredth of an ampere is an ampere",
        "hw/playback/units.py",
        "times = _TIMES.fullmatch(said)",
        "times = None",
        UNITS,
    ),
    Seed(
        "negative torques that wrapped are a magnitude",
        "rtctl/friction/logs/torque_faults.py",
        "> WRAPPED_SHARE * top and",
        "> 9 * top and",
        TORQUES,
    ),
    Seed(
        "a position of few levels is one that rests",
        "rtctl/friction/logs/log_checks.py",
        "        _require_levels(logs, signals)\n",
        "",
        ("tests/unit/friction/test_log_input.py",),
    ),
    Seed(
        "a torque rounded to 0 is a motor that is off",
        "rtctl/friction/logs/torque_faults.py",
        "    if len(np.unique(motor)) < LEVELS_MIN:\n        return  # 0",
        "    if len(np.unique(motor)) < 0:\n        return  # 0",
        DIRT,
    ),
    Seed(
        "a link in a MATLAB file leads to any other file",
        "hw/playback/matlab_hdf.py",
        "return group[name] if isinstance(group.get(name, getlink=True), self.h5py.HardLink) else None",
        "return group[name]",
        HDF,
    ),
    Seed(
        "a MATLAB file may unpack to anything",
        "hw/playback/matlab_hdf.py",
        "if self.left < 0:",
        "if self.left < -(10**12):",
        HDF,
    ),
    Seed(
        "a command that each row begins is one that was held until it",
        "rtctl/friction/logs/regression.py",
        "for halves in (1, 2):",
        "for halves in (1,):",
        (
            "tests/unit/friction/test_truth_of_intervals.py"
            "::test_a_current_measured_with_the_position_is_known_where_it_is_surely_not_held",
        ),
    ),
    Seed(
        "a clock that gains little is a delay",
        "rtctl/friction/logs/two_clocks.py",
        "if abs(gained_s) < max(GAINED_S,",
        "if abs(gained_s) < max(9.0,",
        ("tests/unit/friction/test_two_clocks.py",),
    ),
    Seed(
        "two torques that are one are two",
        "rtctl/friction/logs/torque_faults.py",
        "> ONE_SIGNAL * sizes[0]",
        "> 9 * sizes[0]",
        TORQUES,
    ),
    Seed(
        "ticks of 100 ns are of any unit",
        "hw/playback/rising.py",
        "if low <= first <= high:",
        "if low < first < low:",
        ("tests/unit/hw/test_stamps_told.py",),
    ),
    Seed(
        "an error names no file",
        "rtctl/errors.py",
        "        error.file = file\n",
        "        error.file = None\n",
        ("tests/unit/friction/test_evidence_page.py::test_one_broken_file_of_several_is_left_out_and_named",),
    ),
    Seed(
        "a log without a time wants its rate",
        "hw/playback/reader.py",
        "if error.column != (options",
        "if error.column == (options",
        LAYOUTS,
    ),
    Seed(
        "a row for each signal is a table without that column",
        "hw/playback/wrong_cells.py",
        "    if not columns:\n",
        "    if columns:\n",
        LAYOUTS,
    ),
    Seed(
        "summer time ends as any clock is set back",
        "hw/playback/rising.py",
        "abs(steps[k] + HOUR_S) < 1.0",
        "abs(steps[k] - HOUR_S) < 1.0",
        LAYOUTS,
    ),
    Seed(
        "an empty row below settings is one of the log",
        "hw/playback/text_rows.py",
        "bool(rows) and headed and not any(wanted)",
        "False",
        LAYOUTS,
    ),
    Seed(
        "a message without the wanted joint is one of its log",
        "rtctl/recording/joint_states.py",
        "asked = asked or set(states[0][1].names)",
        "asked = set(states[0][1].names)",
        LAYOUTS,
    ),
    Seed(
        "days of a duration are none",
        "hw/playback/cells.py",
        "days?,? )?",
        "jours?,? )?",
        LAYOUTS,
    ),
    Seed(
        "colons within brackets part a name", "rtctl/cli/columns.py", 'r":(?![^\\[(]*[\\])])"', '":"', LAYOUTS
    ),
    Seed(
        "an offset drifts while nothing is recorded",
        "rtctl/friction/logs/offsets.py",
        "time_s = recorded_s(signals.time_s[rows])",
        "time_s = signals.time_s[rows] - signals.time_s[rows[0]]",
        DIRT,
    ),
    Seed(
        "what is left over in bursts is noise",
        "rtctl/friction/logs/left_over.py",
        "max(power - usual**2, *smooth)",
        "max(0.0, *smooth)",
        ("tests/unit/friction/test_other_makes.py",),
    ),
    Seed(
        "one delay is looked for more coarsely than two",
        "rtctl/friction/logs/late_torques.py",
        "key=lambda each: left(each, each)",
        "key=lambda each: abs(each - delays[best])",
        DIRT,
    ),
    Seed(
        "a joint that is held stands",
        "rtctl/friction/logs/held_still.py",
        "if stood_s < STANDS_S:",
        "if stood_s >= 0:",
        DIRT,
    ),
    Seed(
        "a motor's torque before a gear is one at the joint",
        "rtctl/cli/identify_log.py",
        'mapped.get("motor_torque")) and behind != 1:',
        'mapped.get("motor_torque")) and behind < 0:',
        (
            "tests/unit/cli/test_identify_log.py"
            "::test_the_report_says_the_units_taken_and_what_nothing_in_the_log_tells",
        ),
    ),
    Seed(
        "a torque in steps is one of a slower bus",
        "rtctl/friction/logs/row_faults.py",
        "            told[name] = None\n",
        "            told[name] = one\n",
        COMMANDS,
    ),
    Seed(
        "a torque that is switched is too coarse",
        "rtctl/friction/logs/torque_faults.py",
        " or _is_switched(signal, levels)",
        "",
        COMMANDS,
    ),
    Seed(
        "a quick stroke of few rows is a jump",
        "rtctl/friction/logs/row_faults.py",
        "        if inside and comes_gradually(velocity, begin, end, brisk):\n            continue\n",
        "",
        COMMANDS,
    ),
    Seed(
        "whatever comes with brisk motion is no jump",
        "rtctl/friction/logs/quick_motion.py",
        "GRADUALLY = 2.0",
        "GRADUALLY = 200.0",
        COMMANDS,
    ),
    Seed(
        "two clocks are told of what friction explains as well",
        "rtctl/friction/logs/two_clocks.py",
        "SURE = 5.0",
        "SURE = 2.0",
        ("tests/unit/friction/test_two_clocks.py",),
    ),
    Seed(
        "whole milliseconds of a clock that jitters are taken as they say",
        "hw/playback/stamps.py",
        " or jitters:",
        ":",
        STAMPS,
    ),
    Seed(
        "a lost row of a clock that jitters is hidden",
        "hw/playback/stamps.py",
        "rest < 0.5 * (step_s + resolution_s) and ",
        "",
        STAMPS,
    ),
    Seed(
        "beside a lost row rounded stamps are taken as they say",
        "hw/playback/stamps.py",
        "    stamps_s = _unrounded(stamps_s, step, resolution_s)\n",
        "",
        STAMPS,
    ),
    Seed(
        "a mark between thousands is read as a decimal point where commas were said",
        "hw/playback/cells.py",
        'return (other if other != delimiter and any(other in text for text in texts) else "") + given',
        'return "" + given',
        CELLS,
    ),
    Seed(
        "a date that is none is the first one",
        "hw/playback/columns.py",
        "np.asarray((stamps - stamped[0])",
        "np.nan_to_num((stamps - stamped[0])",
        CELLS,
    ),
    Seed(
        "a channel called time is looked for as the clock of its group",
        "hw/playback/tdms.py",
        "channels.get(name if name in channels else name.removesuffix(CLOCK))",
        "channels.get(name.removesuffix(CLOCK))",
        ("tests/unit/hw/test_tdms.py",),
    ),
)
