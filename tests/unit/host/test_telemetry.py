import tempfile
from dataclasses import replace
from pathlib import Path

import msgpack
import numpy as np
import pytest
import zmq
from patience import PATIENCE_S, until

from rtctl.control.vocabulary import State
from rtctl.host.exchange.rig_description import AxisDescription, RigDescription
from rtctl.host.exchange.streams import MOST_ROWS, QUEUE_BYTES, Telemetry, queue_messages
from rtctl.tick import new_ticks, tick_dtype
from rtctl.wire.protocol import TOPIC_EVENT, TOPIC_HEALTH, TOPIC_STATE, TOPIC_TICKS, Endpoints

MARK = b"mark"
RIG = RigDescription("mock", (AxisDescription("a", {}),), 1000.0, session=7)


class Clock:
    ns = 0

    def __call__(self):
        return self.ns


class Air:
    """A telemetry socket and subscribers to it."""

    def __init__(self, folder):
        self.endpoints = Endpoints(f"ipc://{folder}/t", f"ipc://{folder}/c")
        self.context = zmq.Context()
        self.clock = Clock()
        self.tick = self.marks = 0
        self.subscribers = []

    def open(self, rig=RIG):
        self.telemetry = Telemetry(self.context, self.endpoints, rig, clock_ns=self.clock)
        return self.telemetry

    def subscribe(self, topic=b"", hwm=100_000, **options):
        socket = self.context.socket(zmq.SUB)
        socket.setsockopt(zmq.LINGER, 0)
        socket.setsockopt(zmq.RCVHWM, hwm)
        for name, value in options.items():
            socket.setsockopt(getattr(zmq, name), value)
        socket.subscribe(topic)
        socket.subscribe(MARK)
        socket.connect(self.endpoints.telemetry)
        self.subscribers.append(socket)
        return socket

    def rows(self, n=10):
        out = new_ticks(n, 1)
        out["tick"] = np.arange(self.tick, self.tick + n)
        out["time_ns"], out["state"], out["fault_first"] = out["tick"] * 1_000_000, State.IDLE, -1
        self.tick += n
        return out

    def mark(self):
        """Send something behind all that was published so far, on the same socket."""
        self.marks += 1
        self.telemetry.socket.send_multipart([MARK, b"%d" % self.marks])

    def heard(self, socket):
        """What a subscriber gets of all that was published so far."""
        self.mark()
        messages = []
        while (frames := received(socket)) != [MARK, b"%d" % self.marks]:
            messages += [] if frames[0] == MARK else [(frames[0], msgpack.unpackb(frames[1]))]
        return messages

    def settle(self, *sockets):
        """Publish once, and wait until every subscriber hears; then empty them."""
        self.clock.ns += 1_000_000_000
        self.telemetry.publish(self.rows(10), 0)
        for socket in sockets:
            until(lambda socket=socket: self.mark() or socket.poll(10), "a subscriber")
            self.heard(socket)

    def close(self):
        for socket in self.subscribers:
            socket.close(linger=0)
        self.telemetry.close()
        self.context.term()


@pytest.fixture
def air():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        made = Air(Path(folder))
        yield made
        made.close()


def received(socket):
    assert socket.poll(PATIENCE_S * 1000), "nothing comes any more"
    return socket.recv_multipart()


def test_every_message_is_a_topic_and_one_payload(air):
    air.open()
    socket = air.subscribe()
    air.settle(socket)
    air.clock.ns += 1_000_000_000
    rows = air.rows(20)
    rows["state"][5:] = State.ARMING
    air.telemetry.publish(rows, 0)
    assert [topic for topic, _ in air.heard(socket)] == [TOPIC_EVENT, TOPIC_STATE, TOPIC_TICKS, TOPIC_HEALTH]


def test_batches_number_every_row_and_the_lost_ones_too(air):
    air.open()
    socket = air.subscribe(TOPIC_TICKS)
    air.settle(socket)
    start = air.tick
    air.telemetry.publish(air.rows(7), 0)
    air.tick += 3  # overwritten in shared memory before the host read them
    air.telemetry.publish(air.rows(5), 3)
    first, second = (message for _, message in air.heard(socket))
    assert (first["row"], first["rows"], first["lost"], first["first_tick"]) == (start, 7, 0, start)
    assert (second["row"], second["rows"], second["lost"]) == (start + 10, 5, 3)
    assert second["sequence"] == first["sequence"] + 1


def test_a_flood_of_rows_is_cut_into_messages_of_bounded_size(air):
    air.open()
    socket = air.subscribe(TOPIC_TICKS)
    air.settle(socket)
    air.telemetry.publish(air.rows(2 * MOST_ROWS + 1), 0)
    assert [message["rows"] for _, message in air.heard(socket)] == [MOST_ROWS, MOST_ROWS, 1]


def test_health_comes_once_a_second_also_when_the_loop_is_silent(air):
    air.open()
    socket = air.subscribe(TOPIC_HEALTH)
    air.settle(socket)
    air.telemetry.commands = lambda: {"malformed": 3}
    air.telemetry.set_realtime([{"right": "scheduling", "granted": False, "detail": "no"}])
    for _ in range(30):
        air.clock.ns += 100_000_000
        air.telemetry.publish(air.rows(0), 5)
    messages = [message for _, message in air.heard(socket)]
    assert len(messages) == 3
    last = messages[-1]
    assert (last["overwritten"], last["commands"], last["wakeup_us"]) == (5, {"malformed": 3}, None)
    assert last["realtime"][0]["granted"] is False


def test_a_host_that_stood_still_tells_one_health_and_the_next_a_second_later(air):
    air.open()
    socket = air.subscribe(TOPIC_HEALTH)
    air.settle(socket)
    air.clock.ns += 5_000_000_000
    for _ in range(10):
        air.telemetry.publish(air.rows(10), 0)
        air.clock.ns += 100_000_000
    assert len(air.heard(socket)) == 1


def test_a_warning_stands_in_health_until_its_event_takes_it_back(air):
    air.open(replace(RIG, axes=(AxisDescription("a", {}, (20.0, 30.0)),)))
    socket = air.subscribe()
    air.settle(socket)
    told, events = [], []
    for celsius in (36.0, 34.5, 33.5):
        air.clock.ns += 1_000_000_000
        rows = air.rows(10)
        rows["temperature_c"] = celsius
        air.telemetry.publish(rows, 0)
        heard = air.heard(socket)
        told += [len(message["warnings"]) for topic, message in heard if topic == TOPIC_HEALTH]
        events += [one["event"] for topic, message in heard if topic == TOPIC_EVENT for one in message]
    assert (told, events) == ([1, 1, 0], ["warning", "warning_cleared"])


def test_nothing_is_dropped_while_nobody_listens(air):
    telemetry = air.open()
    for _ in range(2000):
        telemetry.publish(air.rows(1), 0)
    assert telemetry.counts()["dropped"] == 0


def test_a_stalled_subscriber_is_counted_and_takes_nothing_from_the_others(air):
    telemetry = air.open()
    stalled = air.subscribe(TOPIC_TICKS, hwm=1, RCVBUF=4096)
    listening = air.subscribe(TOPIC_TICKS)
    air.settle(stalled, listening)
    rows, start = [], air.tick
    for _ in range(900):
        telemetry.publish(air.rows(60), 0)
        rows.append(msgpack.unpackb(received(listening)[1])["row"])
    assert telemetry.counts()["dropped"] >= 1
    assert rows == list(range(start, air.tick, 60))
    late = 0
    while stalled.poll(50):
        late += len(stalled.recv_multipart()) // 2
    assert late < 900, "the stalled one must have lost some, or the test proves nothing"


def test_queues_hold_seconds_at_any_batch_length():
    assert queue_messages(replace(RIG, batch_s=0.02)) >= 5 * 3 * 50
    assert queue_messages(replace(RIG, batch_s=0.008)) >= 5 * 3 * 125
    assert queue_messages(replace(RIG, batch_s=1.0, rate_hz=100.0)) >= 100


@pytest.mark.parametrize(("axes", "rate_hz"), [(1, 10_000.0), (8, 1000.0), (8, 20_000.0)])
@pytest.mark.parametrize("batch_s", [0.002, 0.1])
def test_queues_hold_no_more_than_their_bytes(axes, rate_hz, batch_s):
    rig = replace(RIG, axes=RIG.axes * axes, rate_hz=rate_hz, batch_s=batch_s)
    ticks = min(MOST_ROWS, round(rate_hz * batch_s)) * tick_dtype(axes).itemsize
    assert queue_messages(rig) / 2 * ticks <= max(QUEUE_BYTES, 8 * ticks)
    assert queue_messages(rig) >= 16


def test_every_topic_of_the_protocol_is_sent():
    from rtctl.wire import protocol

    named = {value for name, value in vars(protocol).items() if name.startswith("TOPIC_")}
    assert set(protocol.TOPICS) == named
