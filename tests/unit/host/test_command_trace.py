import numpy as np

from rtctl.host.command_trace import CommandTrace
from rtctl.rt.shared_memory import CommandWriter, Memory
from rtctl.tick import new_ticks


def made():
    memory = Memory.create(1, 8, 1_000_000)
    writer = CommandWriter(memory)
    return memory, writer, CommandTrace(writer, 1)


def rows(*sequence):
    out = new_ticks(len(sequence), 1)
    out["command_seq"] = sequence
    return out


def test_only_commands_that_came_into_force_are_told_once_and_in_order():
    memory, writer, trace = made()
    for share in range(6):
        writer.command["compensation"] = share / 10
        writer.send()
    assert trace.take(rows(0, 0))["seq"].tolist() == []
    first = trace.take(rows(0, 2, 2, 3))
    assert first["seq"].tolist() == [2, 3]
    assert np.allclose(first["compensation"][:, 0], [0.1, 0.2])
    assert trace.take(rows(3, 3))["seq"].tolist() == []
    assert trace.take(rows())["seq"].tolist() == []
    assert trace.take(rows(6))["seq"].tolist() == [6]
    assert (trace.newest["seq"][0], trace.lost) == (6, 0)
    assert len(writer.sent) == 0
    memory.close()


def test_a_command_nobody_remembers_is_counted():
    memory, writer, trace = made()
    writer.send()
    writer.send()
    writer.sent.popleft()
    assert trace.take(rows(1, 2))["seq"].tolist() == [2]
    assert trace.lost == 1
    memory.close()


def test_what_was_sent_is_a_copy():
    memory, writer, trace = made()
    writer.command["epoch"] = 4
    writer.send()
    writer.command["epoch"] = 5
    assert trace.take(rows(1))["epoch"].tolist() == [4]
    memory.close()
