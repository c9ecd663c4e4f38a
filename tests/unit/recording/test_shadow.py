import io

import numpy as np
import pytest
from run_maker import run, setup

from rtctl.errors import DataError
from rtctl.friction.drift_recorded import over_ticks
from rtctl.recording.law_arrays import unpack_law
from rtctl.recording.limits import Limits
from rtctl.recording.parts import Parts
from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay
from rtctl.recording.shadow import ShadowLaw
from rtctl.rig_file.friction_tables import DriftTable


def shadow():
    return ShadowLaw(unpack_law(setup().attachments["law.npz"][1], 1), 1)


def test_what_an_older_archive_of_the_law_lacks_is_named_and_no_drift_is_told_of_it():
    """Its 0 said "no force sensor" of a rig that had one."""
    whole = np.load(io.BytesIO(setup().attachments["law.npz"][1]))
    kept = {name: array for name, array in whole.items() if name != "params.force_used"}
    buffer = io.BytesIO()
    np.savez(buffer, **kept)
    law = unpack_law(buffer.getvalue(), 1)
    named = [name for name in law.missing if not name.startswith("state.")]
    assert named == ["params.force_used"]
    with pytest.raises(DataError, match=r"earlier version .* params\.force_used: .*record anew"):
        over_ticks(law.params, law.model, ["joint"], [], DriftTable(), law.missing)


def follow(law, rows, commands, until, batch=20):
    seen = law.next_row and int(rows["command_seq"][law.next_row - 1])
    for first in range(law.next_row, until, batch):
        some = rows[first : min(first + batch, until)]
        fresh = commands[(commands["seq"] > seen) & (commands["seq"] <= some["command_seq"].max())]
        seen = max(seen, int(some["command_seq"].max()))
        law.follow(first, some, fresh)


@pytest.mark.parametrize("at", [20, 640, 1300, 2000])
def test_a_recording_that_begins_in_the_middle_replays_bit_for_bit_with_the_shadows_state(tmp_path, at):
    rows, commands = run()
    law = shadow()
    follow(law, rows, commands, at)
    assert (law.why, law.next_row) == ("", at)
    in_force = commands[commands["seq"] == rows["command_seq"][at - 1]]
    later = commands[commands["seq"] > rows["command_seq"][at - 1]]
    parts = Parts(tmp_path, setup(), Limits(free_bytes=0))
    parts.add(at, rows[at:], [], np.concatenate((in_force, later)), law.state())
    parts.close({})
    verdict = Replay(RecordingReader(parts.files)).check()
    assert (verdict.first, verdict.stopped, verdict.ticks) == (None, "", len(rows) - at)


def test_the_state_given_away_is_a_copy():
    rows, commands = run()
    law = shadow()
    follow(law, rows, commands, 100)
    law.state()["position_rad"] = 99.0
    assert law.state()["position_rad"][0, 0] != 99.0


def test_a_lost_tick_an_unknown_command_or_another_result_make_the_state_unknown():
    rows, commands = run()
    lost, unknown, other = shadow(), shadow(), shadow()
    follow(lost, rows, commands, 100)
    lost.follow(101, rows[101:120], commands[:0])
    assert "lost" in lost.why
    unknown.follow(0, rows[:100], commands[:0])
    assert "command" in unknown.why
    changed = rows[:100].copy()
    changed["torque_applied_nm"][60] = 1e-9
    other.follow(0, changed, commands)
    assert f"tick {rows['tick'][60]}" in other.why
    for law in (lost, unknown, other):
        assert law.state() is None
        why = law.why
        law.follow(0, rows[:100], commands)
        assert law.why == why, "the first reason stays"


def test_every_part_of_a_long_recording_replays_by_itself(tmp_path):
    rows, commands = run()
    law, parts = shadow(), Parts(tmp_path, setup(), Limits(file_s=0.6, free_bytes=0))
    seen = 0
    for first in range(0, len(rows), 20):
        some = rows[first : first + 20]
        fresh = commands[(commands["seq"] > seen) & (commands["seq"] <= some["command_seq"].max())]
        seen = max(seen, int(some["command_seq"].max()))
        parts.add(first, some, [], fresh, law.state())
        law.follow(first, some, fresh)
    parts.close({})
    assert len(parts.files) >= 3
    ticks = 0
    for path in parts.files:
        verdict = Replay(RecordingReader([path])).check()
        assert (verdict.first, verdict.stopped) == (None, "")
        ticks += verdict.ticks
    assert ticks == len(rows)
