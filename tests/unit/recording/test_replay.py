import numpy as np
import pytest
from click.testing import CliRunner
from run_maker import CONFIGS, run, setup, write

from rtctl.cli.replay import command as replay
from rtctl.errors import ConfigError, DataError, RecordingError
from rtctl.recording.compare import compare, numbers, plot_comparison
from rtctl.recording.law_runner import CommandBook, LawRunner
from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay
from rtctl.rig_file.config import load


@pytest.mark.parametrize("config", ["mock.toml", "mock-2axis.toml", "mock-wall.toml"])
def test_a_run_is_given_again_bit_for_bit(tmp_path, config):
    rows, commands = run(config)
    assert (rows["state"] == 3).sum() > 1000
    verdict = Replay(RecordingReader(write(tmp_path, rows, commands, setup(config)).files)).check()
    assert (verdict.first, verdict.differing, verdict.stopped) == (None, {}, "")
    assert verdict.ticks == len(rows)


@pytest.mark.parametrize("field", ["position_rad", "current_a", "force_n", "estop", "torque_applied_nm"])
def test_a_single_bit_that_differs_is_found_and_named(tmp_path, field):
    rows, commands = run()
    rows = rows.copy()
    at = 2500
    words = rows[field][at : at + 1].reshape(-1).view(np.uint64).copy()
    words[1 if field == "force_n" else -1] ^= np.uint64(1 if field == "torque_applied_nm" else 1 << 20)
    rows[field][at] = words.view(rows[field].dtype).reshape(rows[field][at].shape)
    verdict = Replay(RecordingReader(write(tmp_path, rows, commands).files)).check()
    assert verdict.first is not None
    assert verdict.first.tick == rows["tick"][at]
    if field == "current_a":
        assert "motor_torque_nm" in verdict.differing
    if field == "torque_applied_nm":
        assert verdict.differing == {"torque_applied_nm": 1}
        assert "torque_applied_nm[0]" in str(verdict.first)


def test_other_parameters_differ(tmp_path):
    rows, commands = run()
    reader = RecordingReader(write(tmp_path, rows, commands).files)
    law = reader.law()
    law.params["friction_gain"] *= 0.5
    verdict = Replay(reader, law).check()
    assert "feedforward_torque_nm" in verdict.differing


def test_parts_are_replayed_as_one_and_a_later_one_alone_is_refused(tmp_path):
    rows, commands = run()
    files = write(tmp_path, rows, commands, limits=Limits(file_s=0.6, free_bytes=0)).files
    assert len(files) > 2
    verdict = Replay(RecordingReader(files)).check()
    assert (verdict.ticks, verdict.first) == (len(rows), None)
    with pytest.raises(DataError, match="middle of a run"):
        Replay(RecordingReader(files[1:]))


def test_it_stops_where_ticks_are_missing(tmp_path):
    rows, commands = run()
    parts = Parts(tmp_path, setup(), Limits(free_bytes=0))
    parts.add(0, rows[:1000], [], commands)
    parts.add(1010, rows[1010:], [], commands[:0])
    parts.close({})
    verdict = Replay(RecordingReader(parts.files)).check()
    assert (verdict.ticks, verdict.first) == (1000, None)
    assert "missing" in verdict.stopped
    with pytest.raises(RecordingError, match="stopped early, after 1000 ticks: ticks are missing"):
        CliRunner().invoke(
            replay, [str(parts.files[0]), "--config", str(CONFIGS / "mock.toml")], catch_exceptions=False
        )


def test_it_stops_where_a_command_is_unknown(tmp_path):
    rows, commands = run()
    verdict = Replay(RecordingReader(write(tmp_path, rows, commands[:-1]).files)).check()
    assert verdict.first is None
    assert verdict.stopped.startswith(f"command {commands['seq'][-1]}, in force at tick")
    assert verdict.ticks == int(np.argmax(rows["command_seq"] == commands["seq"][-1]))


def test_a_recording_without_the_laws_arrays_is_refused(tmp_path):
    from rtctl.recording.setup import Setup

    rows, commands = run()
    bare = Setup(setup().about, {})
    with pytest.raises(DataError, match=r"law\.npz"):
        Replay(RecordingReader(write(tmp_path, rows[:50], commands, bare).files))


def test_the_same_rig_file_compares_equal_and_another_one_does_not(tmp_path):
    rows, commands = run()
    reader = RecordingReader(write(tmp_path, rows, commands).files)
    same = numbers(compare(reader, load(CONFIGS / "mock.toml")))
    assert same["torque_applied_nm"]["difference"] == [0.0]
    assert same["active_s"]["recorded"] == same["active_s"]["other"] > 1.0
    text = (CONFIGS / "mock.toml").read_text().replace('"friction/', f'"{CONFIGS}/friction/')
    weak = tmp_path / "weak.toml"
    assert text.count("gain = 0.95 ") == 1
    weak.write_text(text.replace("gain = 0.95 ", "gain = 0.475 "))
    other = compare(reader, load(weak))
    found = numbers(other)["feedforward_torque_nm"]
    assert 0.4 < found["other"][0] / found["recorded"][0] < 0.6
    plot_comparison(other, tmp_path / "both.png", ("mock.toml", "weak.toml"))
    assert (tmp_path / "both.png").stat().st_size > 20_000
    wall = numbers(compare(reader, load(CONFIGS / "mock-wall.toml")))
    assert wall["coupling_torque_nm"]["difference"][0] > 0 or wall["torque_applied_nm"]["difference"][0] > 0


def test_a_recording_as_columns_compares_equal_over_all_its_chunks(tmp_path):
    rows, commands = run()
    rows = rows[:600]
    found = compare(RecordingReader(with_states(tmp_path, rows, commands)), load(CONFIGS / "mock.toml"))
    assert np.array_equal(found.recorded["time_ns"], rows["time_ns"])
    assert numbers(found)["torque_applied_nm"]["difference"] == [0.0]


def test_a_rig_of_another_size_or_rate_is_refused(tmp_path):
    rows, commands = run()
    reader = RecordingReader(write(tmp_path, rows[:100], commands).files)
    for name in ("mock-2axis.toml", "mock-10khz.toml"):
        with pytest.raises(ConfigError, match=r"axes at .* Hz"):
            compare(reader, load(CONFIGS / name))


def test_a_rig_whose_axes_move_otherwise_is_refused(tmp_path):
    rows, commands = run()
    reader = RecordingReader(write(tmp_path, rows[:100], commands).files)
    with pytest.raises(ConfigError, match="axes are linear, but those of the recording rotary"):
        compare(reader, load(CONFIGS / "mock-linear.toml"))


def test_the_torques_of_a_linear_axis_are_told_in_newtons(tmp_path):
    rows, commands = run("mock-linear.toml")
    file = write(tmp_path, rows[:500], commands, setup("mock-linear.toml")).files[0]
    told = CliRunner().invoke(replay, [str(file), "--config", str(CONFIGS / "mock-linear.toml")])
    assert told.exit_code == 0, told.output
    assert "RMS, N " in told.output
    assert "torque_applied_n " in told.output


def with_states(folder, rows, commands, config="mock.toml", spoil=None, lived=None):
    """A recording as columns with the law's state before each batch, of the ticks it `lived` (these); `spoil`
    makes something of the state before row k.
    """
    made = setup(config, rate_hz="10000.0")
    parts = Parts(folder, made, Limits(free_bytes=0))
    law = LawRunner(RecordingReader(write(folder / "own", rows[:5], commands, made).files).law(), made.n_axes)
    book = CommandBook(made.n_axes)
    book.learn(commands)
    for k in range(0, len(rows), 50):
        some, state = rows[k : k + 50], law.state.copy()
        parts.add(
            k, some, [], commands if k == 0 else commands[:0], state if spoil is None else spoil(k, state)
        )
        some = some if lived is None else lived[k : k + 50]
        law.run(some, book.commands, book.find(some["command_seq"])[0])
    parts.close({})
    return parts.files


@pytest.mark.parametrize("config", ["mock.toml", "mock-2axis.toml"])
def test_chunks_beside_each_other_give_what_they_give_one_after_another(tmp_path, config):
    rows, commands = run(config)
    files = with_states(tmp_path, rows, commands, config)
    assert sum(batch.state is not None for batch in RecordingReader(files).batches()) >= 5
    replay = Replay(RecordingReader(files))
    verdict = replay.check()
    assert (verdict.ticks, verdict.first, verdict.differing) == (len(rows), None, {})
    assert replay.by_states >= 5
    assert verdict.law_s > 0


def test_a_state_that_the_law_did_not_come_to_is_not_believed(tmp_path):
    rows, commands = run()

    def spoil(k, state):
        if k >= 1500:
            state["energy_hand_j"] += 1.0
        return state

    replay = Replay(RecordingReader(with_states(tmp_path, rows, commands, spoil=spoil)))
    verdict = replay.check()
    assert (verdict.ticks, verdict.first, verdict.differing) == (len(rows), None, {})
    assert 0 < replay.by_states <= 3


def test_what_differs_is_the_same_with_states_and_without(tmp_path):
    rows, commands = run()
    lived, rows = rows, rows.copy()
    for at in (700, 2500, 2501):
        rows["force_n"][at, 1] += 0.25  # the law goes on from another force than the loop did
    rows["torque_applied_nm"][2600] += 1e-12
    files = with_states(tmp_path, rows, commands, lived=lived)
    told = [
        Replay(RecordingReader(paths)).check()
        for paths in (files, write(tmp_path / "rows", rows, commands).files)
    ]
    assert told[0].first is not None
    assert str(told[0].first) == str(told[1].first)
    assert told[0].differing == told[1].differing
    assert told[0].ticks == told[1].ticks == len(rows)
