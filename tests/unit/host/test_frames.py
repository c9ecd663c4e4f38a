import tempfile

import pytest
import zmq
from patience import until

from rtctl.wire import long_messages as module
from rtctl.wire.entrances import Access
from rtctl.wire.long_messages import Frames
from rtctl.wire.protocol import Endpoints


class Doorstep:
    """A ROUTER door, its reader, and DEALERs before it."""

    def __init__(self, folder):
        self.context, self.expelled = zmq.Context(), []
        self.endpoints = Endpoints(f"ipc://{folder}/t", f"ipc://{folder}/c", f"ipc://{folder}/x")
        self.access = Access(self.context, self.endpoints)
        (self.door,) = self.access.routers("command", 0, {zmq.RCVHWM: 8})
        self.frames = Frames(
            self.door, lambda door, frame: self.expelled.append((door, frame.get("User-Id")))
        )
        self.clients = []

    def client(self):
        dealer = self.context.socket(zmq.DEALER)
        dealer.connect(self.endpoints.command)
        self.clients.append(dealer)
        return dealer

    def turn(self):
        """One turn of the host: the message that comes, or None."""
        self.access.authenticator.serve()
        self.access.look()
        self.door.socket.poll(5)
        try:
            return self.frames.read()
        except zmq.Again:
            return None

    def close(self):
        for dealer in self.clients:
            dealer.close(linger=0)
        self.access.close()
        self.context.term()


@pytest.fixture
def step():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = Doorstep(folder)
        yield made
        made.close()


def test_a_short_message_comes_whole(step):
    step.client().send_multipart([b"", b"payload"])
    message = until(step.turn)
    assert [frame.bytes for frame in message.frames] == [b"", b"payload"]
    assert step.expelled == []


def test_a_message_of_too_many_frames_expels_its_sender_once_and_the_next_one_is_read(step):
    client = step.client()
    client.send_multipart([b"x"] * 20_000)
    client.send(b"after")
    assert until(step.turn).frames == []
    assert [(door, who.startswith("ipc:")) for door, who in step.expelled] == [(step.door, True)]
    turns = 0
    while (message := step.turn()) is None:
        turns += 1
    assert turns >= 20_000 // module.FRAMES_PER_TURN, "read away in one turn"
    assert [frame.bytes for frame in message.frames] == [b"after"]
    assert len(step.expelled) == 1


def test_one_frame_too_many_at_the_very_end_is_no_message_that_goes_on(step):
    client = step.client()
    client.send_multipart([b"x"] * (module.MOST_FRAMES + 1))
    client.send(b"after")
    assert until(step.turn).frames == []
    assert [frame.bytes for frame in until(step.turn).frames] == [b"after"]


def test_what_would_take_too_long_to_read_away_is_cut_off_with_its_door(step, monkeypatch):
    monkeypatch.setattr(module, "MOST_READ_AWAY", 8 * module.FRAMES_PER_TURN)
    client = step.client()
    client.send_multipart([b"x"] * 50_000)
    until(step.turn)
    before = step.door.socket
    until(lambda: step.turn() is None and step.door.socket is not before, "the door opened anew")
    assert step.access.renewed()
    other = step.client()
    other.send(b"heard")
    assert [frame.bytes for frame in until(step.turn).frames] == [b"heard"]


def test_a_door_that_is_cut_while_a_message_is_read_away_loses_no_other(step):
    client = step.client()
    client.send_multipart([b"x"] * 20_000)
    assert until(step.turn).frames == []
    client.close(linger=0)
    step.door.cut()
    other = step.client()
    other.send(b"stop")
    # behind it: a test that waited for a message that is lost would wait for long
    other.send(b"after")
    assert [frame.bytes for frame in until(step.turn).frames] == [b"stop"]
