"""`docs/protocol.md` is enough: a client from that text alone, and the text held against the code."""

import itertools
import json
import re
import struct
import tempfile
import time
from pathlib import Path

import msgpack
import pytest
import zmq
from patience import PATIENCE_S, until

DOCUMENT = Path(__file__).parents[2] / "docs" / "protocol.md"

# -- the client: pyzmq, msgpack and the document; nothing of rtctl ------------------------------------------


class DocumentClient:
    def __init__(self, directory, rig, kind=zmq.DEALER):
        self.context = zmq.Context()
        self.command = self.context.socket(kind)
        self.command.setsockopt(zmq.LINGER, 0)
        self.command.setsockopt(zmq.IMMEDIATE, 1)
        self.command.connect(f"ipc://{directory}/{rig}/command")
        self.targets = self.context.socket(zmq.DEALER)
        self.targets.setsockopt(zmq.LINGER, 0)
        self.targets.setsockopt(zmq.CONFLATE, 1)
        self.targets.connect(f"ipc://{directory}/{rig}/targets")
        self.telemetry = self.context.socket(zmq.SUB)
        self.telemetry.setsockopt(zmq.LINGER, 0)
        self.telemetry.setsockopt(zmq.RCVHWM, 10_000)
        self.telemetry.subscribe(b"rtctl/")
        self.telemetry.connect(f"ipc://{directory}/{rig}/telemetry")
        self.next_id = 0

    def close(self):
        self.command.close()
        self.targets.close()
        self.telemetry.close()
        self.context.term()

    def ask(self, op, **keys):
        self.next_id += 1
        self.command.send(msgpack.packb({"id": self.next_id, "op": op, **keys}))
        assert self.command.poll(PATIENCE_S * 1000), "no reply"
        reply = msgpack.unpackb(self.command.recv())
        assert reply["id"] == self.next_id
        assert reply["op"] == op
        return reply

    def hear(self, enough):
        """Payloads by topic, until they are enough."""
        heard = {}
        end = time.monotonic() + PATIENCE_S
        while not enough(heard):
            assert self.telemetry.poll(max(0.0, end - time.monotonic()) * 1000), f"heard {list(heard)} only"
            topic, payload = self.telemetry.recv_multipart()
            heard.setdefault(topic.decode(), []).append(msgpack.unpackb(payload))
        return heard

    def samples(self, enough):
        """State samples, until they are enough."""
        heard = self.hear(lambda heard: enough(list(flat(heard.get("rtctl/state", [])))))
        return list(flat(heard["rtctl/state"]))


flat = itertools.chain.from_iterable


def read_column(column):
    """Values of a column, as nested lists for two dimensions."""
    letter = {"<i8": "q", "<u8": "Q", "<f8": "d"}[column["dtype"]]
    shape = column["shape"]
    count = shape[0] * (shape[1] if len(shape) == 2 else 1)
    values = struct.unpack(f"<{count}{letter}", column["data"])
    if len(shape) == 1:
        return list(values)
    return [list(values[8 * r * shape[1] // 8 :][: shape[1]]) for r in range(shape[0])]


# -- the rig it talks to ------------------------------------------------------------------------------------


@pytest.fixture
def root():
    with tempfile.TemporaryDirectory(prefix="rt") as folder:
        yield Path(folder)


@pytest.fixture
def rig(root):
    from fake_rig import FakeRig

    with FakeRig(root, names=("base", "tip")) as running:
        yield running


@pytest.fixture
def client(rig, root):
    made = DocumentClient(root, "mock")
    yield made
    made.close()


def wait_for_state(client, name):
    until(lambda: client.ask("status")["state"] == name, name)


def in_fault(heard):
    """Whether health, which comes once a second, tells of the fault and what else is sent has been heard."""
    told = any(health["state"] == "FAULT" for health in heard.get("rtctl/health", []))
    return told and {"rtctl/event", "rtctl/ticks"} <= set(heard)


def test_it_arms_moves_the_proxy_and_stops(client):
    hello = client.ask("hello")
    assert hello["result"]["protocol"] == 1
    axes = [axis["name"] for axis in hello["result"]["axes"]]
    assert axes == ["base", "tip"]
    assert hello["result"]["axes"][0]["bounds"]["position_rad"] == [-3.0, 3.0]
    armed = client.ask("arm", epoch=hello["epoch"])
    assert armed["ok"]
    wait_for_state(client, "ACTIVE")
    given = client.ask("lease", epoch=armed["epoch"])["result"]
    assert (len(given["lease"]), len(given["target_position_rad"])) == (16, 2)
    mine = {"epoch": armed["epoch"], "lease": given["lease"]}
    seq = client.ask("target", **mine, position_rad=[0.5, -0.5])["result"]["command_seq"]
    taken = client.samples(lambda samples: samples and samples[-1]["command_seq"] >= seq)
    taken = [sample for sample in taken if sample["command_seq"] >= seq]
    assert taken[0]["proxy_position_rad"] == [0.5, -0.5]
    assert client.ask("stop")["ok"]
    wait_for_state(client, "IDLE")
    void = client.ask("target", **mine, position_rad=[0, 0])
    assert (void["ok"], void["error"]["code"]) == (False, "wrong_epoch")
    void = client.ask("target", epoch=void["epoch"], lease=given["lease"], position_rad=[0, 0])
    assert (void["ok"], void["error"]["code"]) == (False, "lease_lost")


def test_it_streams_targets_to_their_own_endpoint_while_it_holds_the_lease(client, root):
    epoch = client.ask("hello")["epoch"]
    lease = client.ask("lease", epoch=epoch)["result"]["lease"]
    assert client.ask("lease", epoch=epoch, lease=lease)["result"]["lease"] == lease
    second = DocumentClient(root, "mock")
    assert second.ask("lease", epoch=epoch)["error"]["code"] == "lease_taken"
    assert second.ask("status")["result"]["lease_holder"]
    second.close()
    target = {"lease": lease, "epoch": epoch, "position_rad": [0.25, -0.25], "velocity_rad_s": [0, 0]}

    def heard():
        client.targets.send(msgpack.packb(target))
        return [sample["proxy_position_rad"] for sample in client.samples(lambda samples: len(samples) >= 5)]

    until(lambda: [0.25, -0.25] in heard(), "the target")
    assert client.ask("release", lease=lease)["ok"]
    assert client.ask("lease", epoch=epoch, lease=lease)["error"]["code"] == "lease_lost"


def test_a_req_client_is_answered_too(rig, root):
    client = DocumentClient(root, "mock", zmq.REQ)
    assert client.ask("hello")["ok"]
    assert client.ask("status")["result"]["fault_first"] is None
    client.close()


def test_it_reads_every_tick_from_the_columns(client):
    batches = client.hear(lambda heard: len(heard.get("rtctl/ticks", [])) > 20)["rtctl/ticks"]
    expected = None
    for batch in batches:
        assert expected in (None, batch["row"]), "a loss that is none"
        expected = batch["row"] + batch["rows"]
        ticks = read_column(batch["columns"]["tick"])
        assert ticks == list(range(batch["first_tick"], batch["first_tick"] + batch["rows"]))
        positions = read_column(batch["columns"]["position_rad"])
        assert all(len(row) == 2 for row in positions)
    wall_s = (read_column(batches[-1]["columns"]["time_ns"])[-1] + batches[-1]["start_wall_ns"]) / 1e9
    assert abs(wall_s - time.time_ns() / 1e9) < 60


def test_it_follows_events_and_health(client, rig):
    client.hear(bool)
    rig.loop.trip.set()
    heard = client.hear(in_fault)
    events = [event for batch in heard["rtctl/event"] for event in batch]
    assert [event["event"] for event in events][:2] == ["fault", "state"]
    assert {event["event"] for event in events[2:]} <= {"fault_cleared"}, "what clears it may come as soon"
    assert (events[0]["name"], events[0]["first_cause"]) == ("OVERSPEED", True)
    assert (events[1]["from"], events[1]["to"]) == ("IDLE", "FAULT")
    health = heard["rtctl/health"][-1]
    assert health["state"] == "FAULT"
    assert health["wakeup_us"]["p50"] == 3.0
    assert health["telemetry"]["dropped"] == 0


def test_samples_are_all_float64_and_numbered(client):
    samples = client.samples(lambda samples: len(samples) > 20)
    numbers = [sample["sequence"] for sample in samples]
    assert numbers == [numbers[0] + i for i in range(len(numbers))]
    for value in samples[0].values():
        assert all(type(leaf) is float for leaf in (value if isinstance(value, list) else [value]))


@pytest.mark.parametrize(
    ("code", "op", "keys"),
    [
        ("unknown_op", "dance", {}),
        ("unknown_key", "reset", {"now": 1}),
        ("missing_key", "arm", {}),
        ("wrong_type", "target", {"epoch": 1, "lease": "0" * 16, "position_rad": [1.0]}),
        ("unknown_axis", "environment", {"axis": "elbow", "kind": "free"}),
        ("out_of_bounds", "compensation", {"share": 1.5}),
        ("wrong_epoch", "arm", {"epoch": 77}),
        ("not_ready", "reset", {}),
    ],
)
def test_refusals_carry_the_documented_codes(client, code, op, keys):
    client.next_id += 1
    client.command.send(msgpack.packb({"id": client.next_id, "op": op, **keys}))
    reply = msgpack.unpackb(client.command.recv())
    assert (reply["ok"], reply["error"]["code"]) == (False, code)
    assert reply["error"]["text"]


def test_a_target_without_a_remote_axis_is_refused_as_documented(client):
    for axis in (0, 1):
        epoch = client.ask("environment", axis=axis, kind="free")["epoch"]
    lease = client.ask("lease", epoch=epoch)["result"]["lease"]
    assert (
        client.ask("target", epoch=epoch, lease=lease, position_rad=[0, 0])["error"]["code"] == "not_remote"
    )


# -- the text held against the code ------------------------------------------------------------------------


def test_the_examples_are_byte_exact():
    examples = re.findall(r"```(?:request|reply)\n(.*)\n(.*)\n```", DOCUMENT.read_text())
    assert len(examples) >= 4
    for text, octets in examples:
        assert msgpack.packb(json.loads(text)).hex(" ") == octets


def test_every_operation_key_topic_state_fault_and_code_is_documented():
    from rtctl.control.vocabulary import Environment, Fault, State
    from rtctl.host.exchange.operations import OPERATIONS
    from rtctl.wire import protocol

    text = DOCUMENT.read_text()
    words = set(re.findall(r"`([^`\s]+)`", text))
    assert set(OPERATIONS) <= words
    assert {key.name for operation in OPERATIONS.values() for key in operation.keys} <= words
    assert {getattr(protocol, name).decode() for name in dir(protocol) if name.startswith("TOPIC_")} <= words
    for state in State:
        assert f"{int(state)} `{state.name}`" in " ".join(text.split())
    for fault in Fault:
        assert f"{int(fault).bit_length() - 1} `{fault.name}`" in " ".join(text.split())
    for kind in Environment:
        assert f"{int(kind)} `{kind.name.lower()}`" in text


def test_the_document_names_every_key_that_is_sent(client, rig):
    words = set(re.findall(r"`([^`\s]+)`", DOCUMENT.read_text()))
    client.hear(bool)
    rig.loop.trip.set()
    heard = client.hear(in_fault)
    sent = set(client.ask("hello")["result"]) | set(client.ask("status")["result"])
    sent |= set(heard["rtctl/ticks"][0]) | set(heard["rtctl/health"][0])
    sent |= {key for event in heard["rtctl/event"][0] for key in event}
    assert sent <= words, sent - words


def test_every_kind_of_event_is_documented_and_what_a_test_pulse_says():
    from rtctl.host import exchange

    rows = {line.split("|")[1].strip(): line for line in DOCUMENT.read_text().splitlines() if "|" in line}
    source = {path.stem: path.read_text() for path in Path(exchange.__path__[0]).glob("*.py")}
    kinds = set(re.findall(r'^EVENT = "(\w+)"', "".join(source.values()), re.MULTILINE))
    kinds |= set(re.findall(r'_event\(rows\[i\], "(\w+)"', source["events"]))
    assert {"measured", "late", "state", "fault"} <= kinds
    assert kinds <= set(re.findall(r"`(\w+)`", rows["`event`"]))
    (pulse,) = (line for line in rows.values() if "`measured`: " in line)
    said = set(
        re.findall(
            r'^ +"(\w+)": ', source["timing_watch"].split("found.append")[1].split("})")[0], re.MULTILINE
        )
    )
    assert {"axis", "gain", "sample_period_s"} <= said <= set(re.findall(r"`(\w+)`", pulse))


def test_the_document_names_every_refusal_code_in_the_source():
    from rtctl.host.exchange import gateway, lease, messages, requests
    from rtctl.host.exchange import motion_requests as steering

    modules = (gateway, lease, messages, requests, steering)
    source = "".join(Path(module.__file__).read_text() for module in modules)
    codes = set(re.findall(r'(?:_RefuseError|Refusal)\(\s*"([a-z_]+)"', source))
    assert len(codes) >= 12
    assert codes <= set(re.findall(r"\| `([a-z_]+)` \|", DOCUMENT.read_text()))
