"""The report over synthetic logs with known friction: the loop runs to the end, and the figures add up."""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from hw.interface import LinkFault
from hw.playback.columns import read_table
from rtctl.cli.playback import _presliding, command
from rtctl.control.vocabulary import State
from rtctl.errors import ConfigError, DataError
from rtctl.friction import artefact
from rtctl.rig_file import config as rig_file
from rtctl.simulation.playback_job import Job, run
from rtctl.simulation.playback_run import changed, run_log, with_bias

RATE_HZ = 1000.0
INERTIA, COULOMB, BIAS = 4e-4, 0.03, 0.012
SHIPPED = Path(__file__).parents[2] / "configs" / "playback.toml"


def write_log(path, *, seconds=6.0, seed=1, jump_at=None, shift=0.0, late_s=0.0):
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    w1, w2 = 2 * np.pi * 0.7, 2 * np.pi * 1.9
    then = t - late_s  # the torque of a row
    v = 0.8 * np.sin(w1 * then + shift) + 0.3 * np.sin(w2 * then)
    a = 0.8 * w1 * np.cos(w1 * then + shift) + 0.3 * w2 * np.cos(w2 * then)
    x = -0.8 / w1 * np.cos(w1 * t + shift) - 0.3 / w2 * np.cos(w2 * t)
    if jump_at is not None:
        x = x + np.where(t >= jump_at, 5.0, 0.0)
    noise = 3e-4 * np.random.default_rng(seed).normal(size=len(t))
    hand = INERTIA * a + COULOMB * np.tanh(v / 0.01) + noise + BIAS
    quantum = 2 * np.pi / 300_000
    lines = [
        f"{i:.9g},{round(p / quantum) * quantum:.12g},{-h:.12g}" for i, p, h in zip(t, x, hand, strict=True)
    ]
    path.write_text("t,x,minus_h\n" + "\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("logs")
    return write_log(folder / "free.csv"), write_log(folder / "other.csv", seed=2, shift=0.6)


def job(logs, **more):
    free, other = logs
    return Job(
        **{
            "log": other,
            "fit_from": (free,),
            "time": {"column": "t"},
            "position": {"column": "x"},
            "hand_torque": {"column": "minus_h", "scale": -1.0},
            "counts_per_rev": 300_000.0,
            **more,
        }
    )


@pytest.fixture(scope="module")
def report(logs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("out")
    result = run(job(logs, plot=folder / "report.png", save_model=folder / "model.json"))
    return result, folder


def test_the_regression_finds_inertia_friction_and_bias(report):
    found = report[0]["log"]
    assert found["inertia_kgm2"] == pytest.approx(INERTIA, rel=0.05)
    assert found["bias_nm"] == pytest.approx(BIAS, abs=5e-4)
    assert found["regression"]["coulomb_nm"] == pytest.approx(COULOMB, rel=0.1)


def test_the_model_predicts_the_friction_of_the_other_log(report):
    found = report[0]["prediction"]
    assert found["rmse_nm"] < 0.1 * found["friction_rms_nm"]
    assert found["in_range_share"] > 0.95
    assert not found["trained_on_it"]


def test_the_feed_forward_is_the_configured_share_of_friction_and_the_rest_is_left(report):
    found = report[0]["interaction"]
    assert found["first_fault"] is None
    for name in ("forward", "backward"):
        part = found[name]
        assert part["feedforward_rms_nm"] == pytest.approx(0.9 * COULOMB, rel=0.05)
        assert part["friction_left_rms_nm"] == pytest.approx(0.1 * COULOMB, abs=0.06 * COULOMB)
    whole = found["all"]
    assert whole["reduction"] == pytest.approx(1 - whole["left_rms_nm"] / whole["hand_rms_nm"])
    assert whole["reduction"] > 0.7
    assert sum(found[name]["share"] for name in ("forward", "backward", "slow")) == pytest.approx(1)


def test_only_ticks_with_full_authority_count(report):
    found = report[0]["interaction"]
    ready, soft_start, edge = 500, 500, 50
    assert found["ticks"] >= 6000
    assert (
        6000 - ready - soft_start - edge - 200 <= found["counted_ticks"] <= 6000 - ready - soft_start - edge
    )


def test_the_model_is_kept_and_the_figure_drawn(report):
    _, folder = report
    assert artefact.load(folder / "model.json").rig == "playback"
    assert (folder / "report.png").read_bytes().startswith(b"\x89PNG")


def test_a_model_trained_on_a_share_is_judged_on_the_rest(logs):
    result = run(
        job(logs, train_share=0.5, hand_torque=None, motor_torque={"column": "minus_h", "scale": -1.0})
    )
    assert "interaction" not in result  # no hand, no interaction
    assert result["held_out"]["samples"] == pytest.approx(0.5 * result["fit"]["logs"][0]["samples"], rel=0.1)
    assert result["held_out"]["rmse_nm"] < 0.1 * COULOMB


def test_logs_to_learn_from_are_looked_at_and_mended_as_by_identify(logs, tmp_path):
    header, *rows = logs[0].read_text().splitlines()
    spiked, clipped = list(rows), []
    for at in (1500, 2777, 4100):
        t, x, torque = spiked[at].split(",")
        spiked[at] = f"{t},{float(x) + 0.5!r},{torque}"
    for row in rows:
        t, x, torque = row.split(",")
        clipped.append(f"{t},{x},{min(float(torque), 0.012)!r}")
    for name, lines in (("spiked", spiked), ("clipped", clipped)):
        (tmp_path / f"{name}.csv").write_text("\n".join([header, *lines]) + "\n")
    found = run(job((tmp_path / "spiked.csv", logs[1])))["fit"]
    assert any("spike" in text for text in found["warnings"]), found["warnings"]
    regression = found["logs"][0]["regression"]
    assert regression["inertia_kgm2"] == pytest.approx(INERTIA, rel=0.05)
    with pytest.raises(DataError, match="clipped"):
        run(job((tmp_path / "clipped.csv", logs[1])))
    with pytest.raises(DataError, match="the same log"):
        run(job((logs[0], logs[1]), fit_from=(logs[0], logs[0])))


def test_a_gap_parts_a_log_to_learn_from(logs, tmp_path):
    header, *rows = logs[0].read_text().splitlines()
    kept = [header, *rows[:2800], *rows[3100:]]
    (tmp_path / "gap.csv").write_text("\n".join(kept) + "\n")
    found = run(job((tmp_path / "gap.csv", logs[1])))["fit"]
    assert len(found["logs"]) == 2
    for each in found["logs"]:
        assert each["regression"]["inertia_kgm2"] == pytest.approx(INERTIA, rel=0.1)


def test_a_fault_in_the_middle_ends_the_torque_and_the_run_still_ends(report, tmp_path):
    broken = write_log(tmp_path / "jump.csv", jump_at=4.0)
    rows = run_log(rig_with(tmp_path, broken, report[1] / "model.json", name="playback"))
    assert np.abs(rows["torque_applied_nm"]).max() > 0.5 * COULOMB
    assert State.FAULT in rows["state"]
    assert rows["state"][-1] == State.SHUTDOWN
    assert rows["fault_first"][-1] >= 0
    assert not rows["torque_applied_nm"][rows["sample_count"] > 4002].any()
    assert rows["link_faults"][-1] == LinkFault.END_OF_LOG


def rig_with(folder, log, model, name="bench", **options):
    table = {
        "schema = 1\n[rig]": f'name = "{name}"',
        "[loop]": 'rate_hz = 1000.0\nclock = "virtual"',
        "[[axis]]": 'name = "lever"\ninertia_kgm2 = 4e-4\nviscous_nms_rad = 0.001\nencoder_counts_per_rev '
        "= 3e5\n"
        "torque_constant_nm_a = 1.0\nlever_m = [0.0, 0.1, 0.0]\ntorque_limit_nm = 1.0\ntorque_rate_nm_s = "
        "100.0\n"
        "velocity_limit_rad_s = 20.0",
        "[axis.force]": "tare_s = 0.0",
        "[axis.friction]": f'model = "{model or ""}"\nintent_nm = 0.006\ngate_nm = 0.003',
        "[passivity]": "budget_j = 100.0",
        "[[device]]": 'kind = "playback"',
        "[device.options]": f'file = "{log}"\ntime = {{ column = "t" }}\n'
        + "".join(f"{key} = {value}\n" for key, value in options.items()),
        "[[device.options.axis]]": 'position = { column = "x" }\n'
        'hand_torque = { column = "minus_h", scale = -1.0, offset = 0.0 }',
    }
    path = folder / "rig.toml"
    path.write_text("\n".join(f"{head}\n{body}" for head, body in table.items()) + "\n")
    return rig_file.load(path)


def test_a_rig_file_gives_columns_and_rig_and_its_own_model_may_be_used(logs, report, tmp_path):
    model = report[1] / "model.json"
    rig_with(tmp_path, logs[1], model, name="playback")
    result = run(Job(config=tmp_path / "rig.toml", inertia_kgm2=None))
    assert result["log"]["inertia_kgm2"] == 4e-4
    assert result["interaction"]["forward"]["feedforward_rms_nm"] == pytest.approx(0.9 * COULOMB, rel=0.05)
    assert run(Job(config=tmp_path / "rig.toml", fit_inertia=True))["log"]["inertia_kgm2"] != 4e-4


def test_removing_the_bias_shifts_the_raw_column_whatever_its_scale(logs, tmp_path):
    loaded = rig_with(tmp_path, logs[1], None)
    shifted = with_bias(loaded.options, loaded.config.hardware(), BIAS)
    rows = run_log(changed(loaded, shifted, {}))
    raw = read_table(logs[1], ("minus_h",)).columns["minus_h"]
    np.testing.assert_allclose(rows["hand_torque_nm"][: len(raw), 0], -raw - BIAS, atol=1e-12)


def test_a_log_repeated_for_ever_has_no_report(logs, tmp_path):
    with pytest.raises(ConfigError, match="repeated for ever"):
        run_log(rig_with(tmp_path, logs[1], None, loop="true"))


def test_a_log_too_short_to_arm_is_refused(logs, tmp_path):
    with pytest.raises(DataError, match="never became ACTIVE"):
        run_log(rig_with(tmp_path, logs[1], None, end_s=0.3))


def test_a_log_of_another_rate_is_refused_with_both_rates(logs, tmp_path):
    path = tmp_path / "rig.toml"
    rig_with(tmp_path, logs[1], None)
    path.write_text(path.read_text().replace("rate_hz = 1000.0", "rate_hz = 2000.0"))
    with pytest.raises(DataError, match=r"sampled at 1000 Hz.*runs at 2000 Hz"):
        run_log(rig_file.load(path))


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"log": Path("absent.csv")}, ConfigError, "no file"),
        ({"fit_from": (Path("absent.csv"),)}, ConfigError, "no file"),
        ({"position": {"column": "y"}}, DataError, "no column 'y'"),
        ({"position": {"column": "x", "scale": 1e6}}, DataError, "e+06 rad/s"),
        ({"hand_torque": None}, DataError, "no motor or hand torque"),
        ({"hand_torque": {"column": "minus_h"}}, DataError, "scale = -1"),
        ({"torque_limit_nm": 1e8}, ConfigError, "not a valid one"),
    ],
)
def test_what_cannot_be_reported_is_a_named_error(logs, change, error, said):
    with pytest.raises(error) as caught:
        run(job(logs, **change))
    assert said in str(caught.value) + " ".join(getattr(caught.value, "faults", ()))


@pytest.mark.parametrize("late_s", [0.0, 0.5 / RATE_HZ])
def test_a_log_is_judged_as_it_is_learned_from(logs, tmp_path, late_s):
    free = write_log(tmp_path / "free.csv", late_s=late_s)
    columns = {"hand_torque": None, "motor_torque": {"column": "minus_h", "scale": -1.0}}
    told = run(job(logs, log=free, fit_from=(free,), **columns))
    assert told["log"] == told["fit"]["logs"][0]


def test_a_rig_file_of_another_kind_is_refused():
    with pytest.raises(ConfigError, match="must be playback, not mock"):
        run(Job(config=SHIPPED.with_name("mock.toml")))


def test_the_command_prints_a_table_or_one_json_object(logs, tmp_path):
    free, other = (str(path) for path in logs)
    arguments = ["--log", other, "--fit-from", free, "--time", "t", "--position", "x"]
    arguments += ["--hand-torque", "minus_h:-1", "--counts-per-rev", "300000"]
    said = CliRunner().invoke(
        command, [*arguments, "--plot", str(tmp_path / "a.png")], catch_exceptions=False
    )
    assert "hand felt" in said.output
    assert "support vectors [" in said.output
    told = CliRunner().invoke(command, [*arguments, "--json"], catch_exceptions=False)
    assert json.loads(told.output)["interaction"]["all"]["reduction"] > 0.7


def test_the_presliding_length_is_that_of_the_turns_unless_it_is_given(logs, report):
    found = report[0]["fit"]["presliding"]
    assert found["length_rad"] + found["spread_rad"] < 5e-4, (
        "the friction of these logs turns within .01 rad/s"
    )
    assert artefact.load(report[1] / "model.json").presliding_rad == found["length_rad"]
    given = run(job(logs, presliding_rad=0.02))
    assert given["fit"]["presliding"] == {"length_rad": 0.02, "spread_rad": None, "ramps": 0}
    reduction = [result["interaction"]["all"]["reduction"] for result in (report[0], given)]
    assert reduction[0] > reduction[1] + 0.1, "a direction that turns late helps less"


def test_logs_that_tell_no_presliding_length_are_taken_for_a_long_one_and_that_is_said():
    assert "not told by these logs: taken for 5 mrad" in _presliding(None, "rotary")
    assert "taken for 0.5 mrad" in _presliding(None, "linear")  # of a handle; `words` makes it mm


def test_the_shipped_example_lacks_nothing_but_the_users_log(tmp_path):
    with pytest.raises(ConfigError) as caught:
        rig_file.load(SHIPPED)
    assert len(caught.value.faults) == 1
    assert "no file" in caught.value.faults[0]
    lines = ["time_s,position_rad,motor_torque_nm,hand_torque_nm"]
    lines += [
        f"{k / 2000:.9g},{0.3 * np.sin(k / 500):.12g},0.0,{-0.01 * np.cos(k / 500):.12g}" for k in range(4000)
    ]
    (tmp_path / "my_log.csv.gz").write_bytes(gzip.compress(("\n".join(lines) + "\n").encode()))
    (tmp_path / "playback.toml").write_text(SHIPPED.read_text())
    rows = run_log(rig_file.load(tmp_path / "playback.toml"))
    assert State.ACTIVE in rows["state"]
    assert rows["state"][-1] == State.SHUTDOWN
