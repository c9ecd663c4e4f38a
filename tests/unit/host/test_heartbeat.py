import pytest

from rtctl.host.heartbeat import BEAT_S, SILENCE_S, Heartbeat, promised_ticks
from rtctl.rig_file.config import load
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.simulation.shipped_files import shipped_config


@pytest.fixture
def writer():
    memory = Memory.create(1, 8, 1_000_000)
    yield CommandWriter(memory)
    memory.close()


def beats(writer):
    return int(writer.command["beat_count"][0])


def test_it_beats_at_its_own_pace_however_often_the_host_turns(writer):
    heart = Heartbeat(writer, 200)
    for millisecond in range(1000):
        heart.beat(5.0 + millisecond / 1000)
    assert beats(writer) == len(writer.sent) == pytest.approx(1.0 / BEAT_S, abs=1)
    assert (writer.sent[0]["beat_count"][0], writer.sent[0]["beat_ticks"][0]) == (1, 200)
    assert SILENCE_S >= 5 * BEAT_S


def test_after_a_standstill_there_is_one_beat_and_no_burst(writer):
    heart = Heartbeat(writer, 200)
    heart.beat(1.0)
    heart.beat(9.0)
    heart.beat(9.001)
    assert beats(writer) == 2


def test_who_promises_nothing_does_not_beat(writer):
    Heartbeat(writer, 0).beat(1.0)
    assert not writer.sent


def config(tmp_path, name, *changes):
    text = shipped_config(name).read_text().replace("friction/mock.json", "")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / name
    path.write_text(text)
    return load(path).config


def test_what_is_promised(tmp_path):
    prefer = 'realtime = "prefer"'
    assert promised_ticks(config(tmp_path, "serial.toml")) == 200, "a real rig at 1 kHz"
    assert promised_ticks(config(tmp_path, "mock.toml", (prefer, 'realtime = "require"'))) == 200
    assert promised_ticks(config(tmp_path, "mock.toml")) == 2000, "nobody holds it, and it may be late"
    assert promised_ticks(config(tmp_path, "mock.toml", ('clock = "wall"', 'clock = "virtual"'))) == 0
