"""`rtctl plot` and `rtctl compare` on the reference recordings."""

import json
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from rtctl import pictures
from rtctl.cli import cli as main_group
from rtctl.cli import plot as plots
from rtctl.cli.plot import _lines, compare
from rtctl.cli.plot import command as plot
from rtctl.control.vocabulary import Fault, State
from rtctl.errors import DataError
from rtctl.recording.panels import PANELS, Run, chosen_panels, figures, plot_runs
from rtctl.tick import FIELD, new_ticks

FILES = Path(__file__).parents[2] / "recordings"
A, B = FILES / "swing-hybrid.mcap", FILES / "swing-dither.mcap"


def call(command, *arguments):
    return CliRunner().invoke(command, [str(argument) for argument in arguments], catch_exceptions=False)


def test_a_picture_of_the_usual_panels_is_written_whole(tmp_path):
    out = tmp_path / "a.png"
    assert call(plot, A, "--out", out).output.strip() == str(out)
    assert out.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert list(tmp_path.iterdir()) == [out]


def test_chosen_fields_get_a_panel_each(tmp_path):
    assert chosen_panels(("force_n", "tick")) == (("force_n",), ("tick",))
    assert chosen_panels(()) == PANELS
    assert all(name in FIELD for names in PANELS for name in names)
    assert call(plot, A, "--out", tmp_path / "f.png", "--fields", "force_n,faults").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "text"),
    [(("--fields", "nonsense"), "no field of the tick"), (("--from", "1e6"), "no tick between")],
)
def test_what_is_not_there_is_named(tmp_path, arguments, text):
    with pytest.raises(DataError, match=text):
        call(plot, A, "--out", tmp_path / "x.png", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_two_recordings_are_compared_in_numbers_and_a_picture(tmp_path):
    done = call(compare, A, B, "--json", "--plot", tmp_path / "both.png")
    body = json.loads(done.output)
    assert body["a"]["file"] == str(A)
    assert body["a"]["hand_torque_nm_rms"] != body["b"]["hand_torque_nm_rms"]
    assert (tmp_path / "both.png").stat().st_size > 10_000
    table = call(compare, A, B).output
    assert "hand_torque_nm_rms" in table
    assert "%" in table
    assert table.startswith(f"A  {A}\nB  {B}\n")
    same = json.loads(call(compare, A, A, "--json").output)
    assert {**same["a"], "file": 0} == {**same["b"], "file": 0}


def test_an_axis_is_drawn_and_told_in_its_own_units_each_with_a_panel(tmp_path, monkeypatch):
    drawn = {}
    monkeypatch.setattr(
        pictures,
        "save",
        lambda figure, path: drawn.update(
            (place.get_ylabel(), [line.get_label() for line in place.lines]) for place in figure.axes
        ),
    )
    rows = new_ticks(100, 2)
    rows["time_ns"] = np.arange(100) * 1_000_000
    both = Run("r", rows, ["crank", "carriage"], ["rotary", "linear"])
    plot_runs([both], tmp_path / "x.png", ["velocity_rad_s", "energy_hand_j"])
    assert drawn["rad/s"] == ["velocity_rad_s crank"]
    assert drawn["m/s"] == ["velocity_m_s carriage"]
    assert drawn["J"] == ["energy_hand_j crank", "energy_hand_j carriage"]
    crank, carriage = _lines("hand_torque_nm_rms", [1.0, 2.0], [1.0, 3.0], both)
    assert crank.startswith("hand_torque_nm_rms crank ")
    assert carriage.startswith("hand_torque_n_rms carriage ")


def test_only_ticks_at_work_count_and_nan_counts_as_nothing():
    rows = new_ticks(100, 1)
    rows["time_ns"] = np.arange(100) * 1_000_000
    rows["state"][50:] = State.ACTIVE
    rows["authority"][60:] = 1.0
    rows["hand_torque_nm"] = 7.0
    rows["hand_torque_nm"][60:] = 2.0
    found = figures(Run("r", rows, ["joint"]))
    assert found["hand_torque_nm_rms"] == [2.0]
    assert found["work_s"] == pytest.approx(0.04)
    rows["hand_torque_nm"][60:80] = np.nan
    assert figures(Run("r", rows, ["joint"]))["hand_torque_nm_rms"] == [2.0]
    rows["hand_torque_nm"] = np.nan
    assert np.isnan(figures(Run("r", rows, ["joint"]))["hand_torque_nm_rms"]).all()
    assert figures(Run("r", rows[:50], ["joint"]))["hand_torque_nm_rms"] == []


def test_what_was_never_at_work_is_said_and_faults_have_names(monkeypatch):
    rows = new_ticks(4, 1)
    rows["faults"] = int(Fault.STALE | Fault.JUMP)
    monkeypatch.setattr(plots, "_run", lambda *_: Run("a", rows, ["joint"], ["rotary"]))
    said = call(compare, A, B).output
    assert said.count("no RMS") == 2
    assert "STALE, JUMP" in said
    assert json.loads(call(compare, A, B, "--json").output)["a"]["faults"] == ["STALE", "JUMP"]


def test_what_was_not_measured_has_no_figure():
    run = Run("a", new_ticks(4, 1), ["joint"], ["rotary"])
    assert _lines("a_rms", [np.nan], [1.0], run)[0].split()[1] == "-"


def test_every_option_says_what_it_is_and_no_bound_is_none():
    for name in main_group.list_commands(click.Context(main_group)):
        one = main_group.get_command(click.Context(main_group), name)
        for command_ in one.commands.values() if isinstance(one, click.Group) else [one]:
            told = command_.get_help(click.Context(command_))
            assert "None" not in told, name
            assert [p.opts for p in command_.params if isinstance(p, click.Option) and not p.help] == [], name
