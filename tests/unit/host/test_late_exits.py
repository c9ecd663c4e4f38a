"""Tasks that end: records of taskstats, and a kernel that tells, refuses, loses and is silent."""

import select
import socket
import struct

import pytest

from rtctl.host.exchange.late_exits import Ended, Exits, ended, exits

MS = 1_000_000


def record(name, number, *, real=0, virtual=0, policy=0):
    """A message of taskstats as a kernel 6 sends it, cut where nothing more is read."""
    stats = struct.pack("<64xQQ32sB15xI", real, virtual, name.encode(), policy, number) + b"\0" * 8
    inner = struct.pack("<HHI", 8, 1, number) + struct.pack("<HH", 4 + len(stats), 3) + stats
    outer = struct.pack("<HH", 4 + len(inner), 4) + inner
    return struct.pack("<IHHII", 20 + len(outer), 31, 0, 0, 0) + b"\2\1\0\0" + outer


def test_a_record_of_taskstats_names_the_task_that_ended():
    assert list(ended(record("hog", 77, real=8 * MS, virtual=7 * MS, policy=1))) == [
        Ended("77", "hog", 7 * MS, realtime=True)
    ]
    assert list(ended(record("sh", 78, real=8 * MS))) == [Ended("78", "sh", 8 * MS, realtime=False)]


@pytest.mark.parametrize("cut", [0, 7, 20, 24, 40, 120])
def test_a_message_that_is_cut_short_says_nothing(cut):
    assert list(ended(record("hog", 77, virtual=MS)[:cut])) == []


class Kernel:
    """A netlink socket: gives what the test has prepared, message by message; an error is raised."""

    def __init__(self, *_arguments):
        self.messages, self.sent = [answer_of(31), OKAY], []

    def bind(self, _address):
        pass

    def setblocking(self, _flag):
        pass

    def send(self, message):
        self.sent.append(message)

    def recv(self, _most):
        if not self.messages:
            raise BlockingIOError
        message = self.messages.pop(0)
        if isinstance(message, OSError):
            raise message
        return message

    def close(self):
        self.messages = []


OKAY = struct.pack("<IHHIIi", 20, 2, 0, 0, 0, 0)
REFUSED = struct.pack("<IHHIIi", 20, 2, 0, 0, 0, -1)


def answer_of(family):
    """The controller's answer: taskstats has this number."""
    return struct.pack("<IHHII", 28, 16, 0, 0, 0) + b"\1\2\0\0" + struct.pack("<HHHH", 6, 1, family, 0)


@pytest.fixture
def kernel(monkeypatch):
    made = Kernel()
    monkeypatch.setattr(socket, "socket", lambda *_arguments: made)
    monkeypatch.setattr(select, "select", lambda ready, *_rest: (ready if made.messages else [], [], []))
    return made


def test_ends_are_heard_of_one_core_and_one_core_only(kernel):
    heard = Exits()
    kernel.messages = [OKAY]
    heard.follow(3)
    heard.follow(3)
    kernel.messages = [OKAY, OKAY]
    heard.follow(0)
    families = [struct.unpack_from("<H", message, 4)[0] for message in kernel.sent]
    assert families == [16, 31, 31, 31]
    assert [message[20:].rstrip(b"\0") for message in kernel.sent[1:]] == [
        b"\6\0\3\0" + b"3",
        b"\6\0\4\0" + b"3",
        b"\6\0\3\0" + b"0",
    ]


def test_what_the_kernel_has_lost_ends_nothing(kernel):
    heard = Exits()
    kernel.messages = [record("a", 1, virtual=MS), OSError(105, "lost"), record("b", 2, virtual=MS)]
    assert [one.name for one in heard.read()] == ["a", "b"]


def test_a_socket_that_only_fails_does_not_hold_the_host_up(kernel):
    heard = Exits()
    kernel.messages = [OSError(9, "gone")] * 5000
    assert heard.read() == []
    assert kernel.messages, "no more were asked than one look may"


def test_a_refusal_and_a_silence_are_errors(kernel):
    heard = Exits()
    kernel.messages = [REFUSED]
    with pytest.raises(PermissionError):
        heard.follow(1)
    kernel.messages = []
    with pytest.raises(TimeoutError):
        heard.follow(1)


def test_a_service_without_the_right_hears_of_no_end(monkeypatch):
    class Refused:
        def __init__(self, *_arguments):
            raise PermissionError

    monkeypatch.setattr(socket, "socket", Refused)
    assert exits() is None
