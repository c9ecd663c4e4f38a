"""Seeded bugs of a linear axis: numbers of a joint taken for m and m/s."""

from __future__ import annotations

from seed import Seed

HANDLE = ("tests/unit/control/test_handle.py",)
PLAYED = ("tests/unit/cli/test_playback_of_a_linear_axis.py",)
WORDS = "tests/unit/cli/test_words_of_a_linear_rig.py"
LOGS = ("tests/unit/cli/test_identify_log_of_a_linear_axis.py",)
WAVES = ("tests/unit/friction/test_waves.py",)
CONTROL = "rtctl/control/"
CHECK = "tests/unit/cli/test_shake_of_a_carriage.py"


def _of_a_joint(what: str, file: str, own: str) -> Seed:
    """`own_rad(p, axis, NUMBER)` of a file becomes the number of a joint."""
    number = own.rpartition(", ")[2].rstrip(")")
    where = own.index("own_rad")
    return Seed(what, CONTROL + file, own, own[:where] + number, HANDLE)


SEEDS = (
    Seed(
        "a carriage has torques", "hw/motion.py",
        """f"{'F' if found[1] == 'T' else 'f'}orce{found[2]}\"""", "found[0]",
        (f"{WORDS}::test_check_tells_a_carriage_in_forces",),
    ),
    Seed(
        "two laws are drawn without units", "rtctl/recording/compare.py",
        "panel.set_ylabel(_label(name, comparison.motions))", "panel.set_ylabel(name)",
        (f"{WORDS}::test_the_figure_of_two_laws_says_what_it_draws",),
    ),
    Seed(
        "the couplings of a carriage are drawn in N m/rad", "rtctl/check/stability_figure.py",
        'words("coupling stiffness k_c [N m/rad]", axis.motion)', '"coupling stiffness k_c [N m/rad]"',
        (f"{WORDS}::test_the_figure_of_check_is_in_the_units_of_its_axis",),
    ),
    Seed(
        "the virtual mass of a carriage is drawn in kg m^2", "rtctl/check/admittance_figure.py",
        'words("virtual mass m [kg m^2]", axis.motion)', '"virtual mass m [kg m^2]"',
        (f"{WORDS}::test_the_figure_of_check_is_in_the_units_of_its_axis",),
    ),
    Seed(
        "a carriage as an admittance is told in N m/rad", "rtctl/cli/check.py",
        "hands = words(hands, axis.motion)", 'hands = words(hands, "rotary")',
        (f"{WORDS}::test_check_tells_the_hands_of_a_virtual_mass_that_slides_in_m",),
    ),
    Seed(
        "a carriage at rest has no torque", "rtctl/cli/operate.py",
        'words("no torque", of_axes(told["axes"]))', '"no torque"',
        (f"{WORDS}::test_status_of_carriages_says_that_there_is_no_force",),
    ),
    Seed(
        "the page explains a carriage's curves by torques", "rtctl/client/view_panel.py",
        "words(item.meaning, motions[i])", "item.meaning",
        (f"{WORDS}::test_the_page_explains_its_curves_in_forces",),
    ),
    Seed(
        "a unit that an axis does not have is told in the axis' own", "hw/motion.py",
        """(?<![\\w/^'])(""", """(?<![\\w/^])(""",
        (f"{LOGS[0]}::test_units_of_both_motions_in_one_log_are_refused",),
    ),
    Seed(
        "a log without units turns", "rtctl/cli/identify_log_text.py",
        """f"{slides}",""", """"",""",
        (f"{LOGS[0]}::test_a_log_of_no_units_is_asked_whether_its_axis_turns",),
    ),
    Seed(
        "a line of the monitor is in rad whatever moves", "hw/motion.py",
        '"linear" if all(axis.get("motion") == "linear"', '"rotary" if all(axis.get("motion") == "linear"',
        ("tests/unit/test_monitor.py",),
    ),
    Seed(
        "a carriage is probed in rad", "rtctl/host/probe_device_readings.py",
        '"rotary" if whole_rig else self._motions[i]', '"rotary"', ("tests/unit/host/test_probe.py",),
    ),
    Seed(
        "a model that a playback learned of a carriage is a joint's", "rtctl/simulation/playback_figures.py",
        "replace(level_points(pool(seen)), motion=rig.moves(0)[0])", "level_points(pool(seen))", PLAYED,
    ),
    Seed(
        "the zero of a hand's force is in N m", "rtctl/simulation/playback_run.py",
        "effort_units(TORQUE_UNITS, *rig.moves(0))[column", "TORQUE_UNITS[column", PLAYED,
    ),
    _of_a_joint("a carriage creeps below 10 mm/s", "assistance.py", "> own_rad(p, axis, CREEP_RAD_S)"),
    _of_a_joint("a carriage rests below 10 mm/s", "resting.py",
        "creep_rad_s = own_rad(p, axis, CREEP_RAD_S)"),
    _of_a_joint(
        "strokes of a carriage below 10 mm/s do not count", "shrinking.py",
        "reference > own_rad(p, axis, CREEP_RAD_S)"
    ),
    _of_a_joint("a carriage must go on by 30 mm to have its help back", "trembling.py",
        "> own_rad(p, axis, ON_RAD)"),
    _of_a_joint(
        "the observer leaves friction to a carriage below 30 mm/s", "disturbance_observer.py",
        "/ own_rad(p, axis, SLOW_RAD_S)"
    ),
    _of_a_joint(
        "a carriage's speed is noise below 20 mm/s", "force_feedback.py",
        "speed, own_rad(p, axis, SPEED_MIN_RAD_S)"
    ),
    Seed(
        "the law is not told that an axis is linear", "rtctl/check/axis_plan.py",
        'p["is_linear"][a] = axis.motion == "linear"', 'p["is_linear"][a] = 0', HANDLE,
    ),
    Seed(
        "hands of a handle .1 m away hold every joint", "rtctl/check/verdict.py",
        "factor = (lever_m / HANDLE_M) ** 2",
        "factor = (lever_m / HANDLE_M) ** 2 if table.motion == \"linear\" else 1.0",
        ("tests/unit/control/test_joints_of_other_sizes.py::test_a_hand_is_the_same_at_every_handle",),
    ),
    Seed(
        "waves that differ by direction are taken out of the torque", "rtctl/friction/logs/waves.py",
        " or apart > ALIKE * size", "", WAVES,
    ),
    Seed(
        "a spring is a wave", "rtctl/friction/logs/waves.py",
        "WAVES_LEAST, WAVES_MOST = 4, 200", "WAVES_LEAST, WAVES_MOST = 0, 200", WAVES,
    ),
    Seed(
        "waves over the travel are looked for to a quarter of one", "rtctl/friction/logs/waves.py",
        "np.linspace(-1, 1, 2 * 100 // TRIES_A_WAVE + 1)", "np.zeros(1)", WAVES,
    ),
    Seed(
        "a weight is a torque that moves", "rtctl/friction/logs/plausibility.py",
        "math.sqrt(max(rms**2 - float(np.mean(weights)), 0.0))", "rms", WAVES,
    ),
    Seed(
        "a part at one speed tells a scale of the velocity", "rtctl/friction/logs/recorded_velocity.py",
        "if size < EVEN_SHARE * float(read.velocity[inside].std()):", "if size < 0:",
        ("tests/unit/friction/test_recorded_velocity.py",),
    ),
    Seed(
        "the step of a position is a small one of those between its rows", "hw/playback/quantum.py",
        "range(1, MOST_PARTS + 1)", "range(1, 1)", ("tests/unit/hw/test_quantum.py",),
    ),
    Seed(
        "a unit that needs a scale is part of a name", "rtctl/cli/columns.py",
        "if before and (other := SPELT.get(said.lower(), said)) in OTHERS:",
        "if before and (other := SPELT.get(said.lower(), said)) is None:",
        ("tests/unit/cli/test_columns_said.py",),
    ),
    Seed(
        "a carriage may shake ten times as fast as a joint does at its handle",
        "rtctl/check/verdicts_of_loop.py",
        'return own_size("shake_rad_s", SHAKE_RAD_S, s.table.motion)', "return SHAKE_RAD_S",
        (f"{CHECK}::test_a_carriage_may_shake_no_faster_than_a_joint_does_at_its_handle",
         f"{CHECK}::test_a_carriage_that_sticks_may_shake_no_faster_either"),
    ),
    Seed(
        "a carriage's shake is refused from ten times the speed on", "rtctl/check/verdicts_of_loop.py",
        'return own_size("felt_rad_s", FELT_RAD_S, s.table.motion)', "return FELT_RAD_S",
        (f"{CHECK}::test_a_carriage_may_shake_no_faster_than_a_joint_does_at_its_handle",),
    ),
    Seed(
        "a pressure is a force", "hw/playback/units.py", '"bar", "Pa", "MPa", "psi", ', "",
        ("tests/unit/hw/test_units_said.py",),
    ),
    Seed(
        "points to judge by are none but of our own files", "rtctl/cli/fit_report.py",
        "points = read_points(path, of_speeds=False) if own else read((path,), of_speeds=False)",
        "points = read_points(path, of_speeds=False)", ("tests/unit/cli/test_fit_points.py",),
    ),
    Seed(
        "what is wrong with forces is said in newton metres", "rtctl/cli/fit_points.py",
        'with errors_in_units_of("linear" if lead_m else', 'with errors_in_units_of("rotary" if True else',
        ("tests/unit/cli/test_fit_points.py",),
    ),
)  # fmt: skip
