"""Seeded bugs that a reading of commands and experiments found: units mixed, mistakes told late, files
replaced."""

from __future__ import annotations

from seed import Seed

EXPERIMENT = ("tests/unit/experiments/test_asked_of_an_experiment.py",)
FIT = ("tests/unit/cli/test_fit_of_what_does_not_fit.py",)

SEEDS = (
    Seed(
        "measurements over a turn are of whatever axis",
        "rtctl/cli/fit_places.py",
        "        require_motion(rows.motion, motion, rows.source)\n",
        "        pass\n",
        FIT,
    ),
    Seed(
        "a sweep in m is read as one in rad",
        "rtctl/cli/fit_places.py",
        "    require_motion(points.motion, motion, path)\n",
        "",
        FIT,
    ),
    Seed(
        "a rotary fit is judged by points of a linear axis",
        "rtctl/cli/fit_report.py",
        "        require_motion(plan.test.motion, measured.motion, plan.test.source)\n",
        "",
        FIT,
    ),
    Seed(
        "points are held against the limits of axes in other units",
        "rtctl/friction/logs/points_check.py",
        "[axis for axis in loaded.config.axis if axis.motion == points.motion]",
        "list(loaded.config.axis)",
        FIT,
    ),
    Seed(
        "a gain is recommended for an axis in other units",
        "rtctl/friction/gain.py",
        "        if axis.motion == model.motion\n",
        "",
        FIT,
    ),
    Seed(
        "a picture replaces the model",
        "rtctl/cli/outputs.py",
        "target.resolve() == picture.resolve()",
        "target.name == picture",
        FIT,
    ),
    Seed(
        "a cut-off that no log carries is asked of the filter",
        "rtctl/friction/logs/regressors.py",
        "        rows_of_a_period(log, cutoff_hz)\n",
        "        pass\n",
        ("tests/unit/cli/test_identify_log.py",),
    ),
    Seed(
        "friction in N is followed as one in N m",
        "rtctl/experiments/models.py",
        "    if points.motion != motion:",
        "    if not points.motion:",
        EXPERIMENT,
    ),
    Seed(
        "a hand lets go before the rig is armed",
        "rtctl/experiments/virtual.py",
        "    while ends_s <= simulation.time_s:",
        "    while ends_s <= 0.0:",
        EXPERIMENT,
    ),
    Seed(
        "a device's velocity that is wrong is judged by nobody",
        "rtctl/simulation/campaign_monitor.py",
        " | Fault.ESTOP | Fault.VELOCITY",
        " | Fault.ESTOP",
        ("tests/unit/control/test_campaign_monitor.py",),
    ),
    Seed(
        "a ring is said to die away by its phase",
        "rtctl/simulation/campaign_in_hands.py",
        "peak, before = (float(np.abs(one).max())",
        "peak, before = (float(np.sqrt(np.mean(one**2)))",
        ("tests/unit/control/test_judge_of_hands.py",),
    ),
)
