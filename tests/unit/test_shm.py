"""Shared memory: single writer, no torn row, nothing lost unseen, the newest command wins."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest

from rtctl.control import mailbox
from rtctl.control.records import command_dtype
from rtctl.rt.shared_memory import HEADER, MAILBOX_SLOTS, CommandWriter, Memory, RingReader, words
from rtctl.tick import new_ticks


@pytest.fixture
def memory():
    memory = Memory.create(2, 64, 1_000_000)
    yield memory
    memory.close()


class Recorder:
    def __init__(self, memory):
        self.memory, self.tick = memory, new_ticks(1, memory.n_axes)

    def put(self, n):
        for _ in range(n):
            self.tick["position_rad"] = self.tick["tick"][0]
            mailbox.publish(self.memory.header, self.memory.ring_words, words(self.tick))
            self.tick["tick"] += 1


def inbox(memory):
    command = np.zeros(2, command_dtype(memory.n_axes))
    return command, words(command)


def test_rows_arrive_complete_and_in_order_through_another_mapping(memory):
    other = Memory.attach(os.dup(memory.fd))
    reader = RingReader(memory)
    Recorder(other).put(40)
    rows = reader.read()
    assert rows["tick"].tolist() == list(range(40))
    assert np.all(rows["position_rad"][:, 1] == rows["tick"])
    assert reader.overwritten == reader.torn == 0
    assert len(reader.read()) == 0


def test_a_slow_reader_counts_what_was_overwritten_and_gets_the_rest(memory):
    reader = RingReader(memory)
    Recorder(memory).put(200)
    rows = reader.read()
    assert rows["tick"][-1] == 199
    assert reader.overwritten + len(rows) == 200
    assert reader.overwritten == 200 - 64 + RingReader.GUARD_ROWS


def test_a_row_whose_seal_does_not_fit_is_never_returned(memory):
    reader = RingReader(memory)
    Recorder(memory).put(10)
    memory.ring["position_rad"][4, 0] += 1.0
    rows = reader.read()
    assert 4 not in rows["tick"]
    assert len(rows) == 9
    assert reader.torn == 1


@pytest.mark.parametrize("word", [0, 3, 17, -1])
@pytest.mark.parametrize("bit", [0, 31, 63])
def test_any_flipped_bit_breaks_the_seal(memory, word, bit):
    recorder = Recorder(memory)
    recorder.put(1)
    row = words(memory.ring[:1].copy())
    assert mailbox.seals_fit(row).all()
    row[0, word] ^= np.uint64(1) << np.uint64(bit)
    assert not mailbox.seals_fit(row).any()


def test_a_zeroed_row_is_not_a_sealed_one():
    assert not mailbox.seals_fit(np.zeros((1, 50), np.uint64)).any()


def test_swapped_words_break_the_seal(memory):
    Recorder(memory).put(3)
    row = words(memory.ring[2:3].copy())
    row[0, [0, 20]] = row[0, [20, 0]]
    assert not mailbox.seals_fit(row).any()


def test_the_compiled_checksum_equals_the_numpy_one():
    row = np.random.default_rng(1).integers(0, 2**64, 77, dtype=np.uint64)
    assert mailbox.compiled_checksum(row, 77) == mailbox.checksum(row)


def test_latest_is_the_newest_row_and_none_before_the_first(memory):
    reader = RingReader(memory)
    assert reader.latest() is None
    Recorder(memory).put(70)
    assert reader.latest()["tick"][0] == 69


def test_the_newest_command_wins_and_counters_lose_no_request(memory):
    writer = CommandWriter(memory)
    command, command_words = inbox(memory)
    assert mailbox.take(memory.header, memory.slot_words, command_words) == 0
    for _ in range(7):
        writer.command["arm_count"] += 1
        writer.send()
    assert mailbox.take(memory.header, memory.slot_words, command_words) == 1
    assert command["arm_count"][0] == 7
    assert mailbox.take(memory.header, memory.slot_words, command_words) == 0


def test_a_half_written_command_changes_nothing_and_is_counted(memory):
    writer = CommandWriter(memory)
    command, command_words = inbox(memory)
    writer.command["compensation"] = 0.25
    writer.send()
    mailbox.take(memory.header, memory.slot_words, command_words)
    writer.command["compensation"] = 0.75
    seq = writer.send()
    memory.slot_words[seq % MAILBOX_SLOTS][3] ^= np.uint64(1)
    assert mailbox.take(memory.header, memory.slot_words, command_words) == 0
    assert command["compensation"][0].tolist() == [0.25, 0.25]
    assert memory.header["commands_refused"][0] == 1
    memory.slot_words[seq % MAILBOX_SLOTS][3] ^= np.uint64(1)
    assert mailbox.take(memory.header, memory.slot_words, command_words) == 1
    assert command["compensation"][0].tolist() == [0.75, 0.75]


def test_an_older_command_is_never_taken(memory):
    writer = CommandWriter(memory)
    command, command_words = inbox(memory)
    for _ in range(3):
        writer.send()
    mailbox.take(memory.header, memory.slot_words, command_words)
    memory.header["mailbox_seq"] = 2
    assert mailbox.take(memory.header, memory.slot_words, command_words) == 0
    assert command["seq"][0] == 3


@pytest.mark.compiled
def test_concurrent_writing_and_reading_returns_only_whole_rows_and_accounts_for_every_one():
    memory = Memory.create(1, 32, 1_000_000)
    reader, done = RingReader(memory), threading.Event()

    def write():
        Recorder(memory).put(30_000)
        done.set()

    thread = threading.Thread(target=write)
    thread.start()
    seen = []
    while not done.is_set():
        seen.append(reader.read())
    thread.join()
    seen.append(reader.read())
    rows = np.concatenate(seen)
    assert np.all(rows["position_rad"][:, 0] == rows["tick"])
    assert np.all(np.diff(rows["tick"]) > 0)
    assert len(rows) + reader.overwritten + reader.torn == 30_000
    memory.close()


def test_attaching_to_something_else_is_refused():
    fd = os.memfd_create("other")
    os.ftruncate(fd, 4096)
    with pytest.raises(ValueError, match="not rtctl's"):
        Memory.attach(fd)
    os.close(fd)


@pytest.mark.parametrize("change", [-1, 1])
def test_nobody_makes_it_smaller_or_larger(memory, change):
    size = os.fstat(memory.fd).st_size
    with (
        Path(f"/proc/self/fd/{memory.fd}").open("r+b", buffering=0) as other,
        pytest.raises(PermissionError),
    ):
        os.ftruncate(other.fileno(), size + change)


def test_one_that_is_too_short_for_what_it_says_is_refused(memory):
    head = os.pread(memory.fd, HEADER.itemsize, 0)
    fd = os.memfd_create("short")
    os.write(fd, head)
    with pytest.raises(ValueError, match="length is greater than file size"):
        Memory.attach(fd)
    os.close(fd)


def test_nothing_with_a_name_is_left_behind(memory):
    assert str(Path(f"/proc/self/fd/{memory.fd}").readlink()).startswith("/memfd:")
    memory.close()
    memory.close()
