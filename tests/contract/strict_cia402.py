"""A CiA 402 drive as strict as CiA 301 and 402-2 allow, made of `canopen`'s LocalNode on python-can's virtual
bus.

Its SDO server, object dictionary, NMT and heartbeat are canopen's; PDOs are read and written as they are
mapped. It refuses: to change the mode while it is enabled, to change an identifier or a mapping while the PDO
exists, bit 30 at all, entries while the count is not 0, more than 8 bytes, what it cannot map, any other
mode, and a size that is not the object's.
"""

import struct
import threading

import canopen
from canopen.objectdictionary import ObjectDictionary, ODRecord, ODVariable
from canopen.objectdictionary.datatypes import (
    INTEGER8,
    INTEGER16,
    INTEGER32,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
)
from canopen.sdo import SdoAbortedError

OFF, NO_REMOTE = 0x8000_0000, 0x4000_0000
NOT_NOW, RANGE, NOT_MAPPABLE, TOO_LONG, READ_ONLY = (
    0x0800_0022,
    0x0609_0030,
    0x0604_0041,
    0x0604_0042,
    0x0601_0002,
)
SIZES = {INTEGER8: "b", INTEGER16: "h", INTEGER32: "i", UNSIGNED8: "B", UNSIGNED16: "H", UNSIGNED32: "I"}
PDOS = {0x1400: 0x1600, 0x1800: 0x1A00, 0x1801: 0x1A01}

OBJECTS = {
    (0x1016, 1): (UNSIGNED32, 0), (0x1017, 0): (UNSIGNED16, 0),
    (0x1018, 1): (UNSIGNED32, 0x2A), (0x1018, 2): (UNSIGNED32, 7), (0x1018, 4): (UNSIGNED32, 4711),
    (0x6007, 0): (INTEGER16, 1), (0x6040, 0): (UNSIGNED16, 0), (0x6041, 0): (UNSIGNED16, 0x40),
    (0x6060, 0): (INTEGER8, 0), (0x6061, 0): (INTEGER8, 0), (0x6064, 0): (INTEGER32, 0),
    (0x606C, 0): (INTEGER32, 0),
    (0x6071, 0): (INTEGER16, 0), (0x6075, 0): (UNSIGNED32, 5000), (0x6076, 0): (UNSIGNED32, 67),
    (0x6077, 0): (INTEGER16, 0), (0x6078, 0): (INTEGER16, 0), (0x60C2, 1): (UNSIGNED8, 4),
    (0x60C2, 2): (INTEGER8, -3),
}  # fmt: skip
MAPPABLE = {0x6040, 0x6071, 0x6041, 0x6064, 0x606C, 0x6077, 0x6078}


class StrictDrive:
    """The drive at `node` of a virtual bus.

    Parameters
    ----------
    lacks
        Objects it has not: indices.
    bit_30
        What it has there in the identifiers of its TPDOs, and insists on.
    fixed_period
        True: 60C2 may only be read.
    shown_mode
        None: 6061 follows 6060, from the third time it is read; else what it shows whatever it was set to.
    no_action
        True: 6007 is 0 and may only be read.
    late_answers
        True: its answer to the request before comes once more, before each answer.
    """

    def __init__(
        self,
        channel,
        node=1,
        *,
        lacks=(),
        bit_30=NO_REMOTE,
        fixed_period=False,
        shown_mode=None,
        no_action=False,
        late_answers=False,
    ):
        self.number, self._bit_30 = node, bit_30
        self._fixed = {0x6061} | ({0x60C2} if fixed_period else set()) | ({0x6007} if no_action else set())
        self._shown_mode, self._mode_read = shown_mode, 0
        values = {key: value for key, value in OBJECTS.items() if not {key, key[0]} & set(lacks)}
        if no_action:
            values[0x6007, 0] = (INTEGER16, 0)
        for communication, mapping in PDOS.items():
            base = {0x1400: 0x200, 0x1800: 0x180, 0x1801: 0x280}[communication]
            flag = 0 if communication == 0x1400 else bit_30
            values[communication, 1] = (UNSIGNED32, flag | base + node)
            values[communication, 2] = (UNSIGNED8, 255)
            values[mapping, 0] = (UNSIGNED8, 1)
            for sub in range(1, 5):
                values[mapping, sub] = (UNSIGNED32, 0x6041_0010 if sub == 1 else 0)
        self.types = {key: kind for key, (kind, _) in values.items()}
        self.local = canopen.LocalNode(node, _dictionary(values))
        self.refusals, self._lock = [], threading.Lock()
        self.local.add_write_callback(self._on_write)
        self.local.add_read_callback(self._on_read)
        self.network = canopen.Network()
        self.network.connect(interface="virtual", channel=channel, ignore_config=True)
        self.network.add_node(self.local)
        self.network.subscribe(0x080, self._on_sync)
        self.network.subscribe(0x200 + node, self._on_rpdo)
        self._pending = b""
        if late_answers:
            self._answer, self._last = self.local.sdo.send_response, None
            self.local.sdo.send_response = self._answer_late
        self.local.nmt.state = "PRE-OPERATIONAL"

    def close(self):
        self.local.nmt.stop_heartbeat()
        self.network.disconnect()

    def __getitem__(self, key):
        data = self.local.get_data(*key)
        return struct.unpack("<" + SIZES[self.types[key]], data)[0]

    def __setitem__(self, key, value):
        data = struct.pack("<" + SIZES[self.types[key]], value)
        self.local.data_store.setdefault(key[0], {})[key[1]] = data

    def _answer_late(self, response):
        if self._last is not None:
            self._answer(self._last)
        self._last = bytes(response)
        self._answer(response)

    # -- objects -----------------------------------------------------------------------------------
    def _on_read(self, index, subindex, od):
        if index == 0x6061 and self._shown_mode is None:
            self._mode_read += 1
            return self[0x6060, 0] if self._mode_read > 2 else 0
        return self._shown_mode if index == 0x6061 else None

    def _on_write(self, index, subindex, od, data):
        value = int.from_bytes(data, "little")
        code = self._objection(index, subindex, value)
        if code:
            self.refusals.append((index, subindex, value, code))
            raise SdoAbortedError(code)

    def _objection(self, index, sub, value):
        if index in self._fixed:
            return READ_ONLY
        if index == 0x6040:
            self._transition(value)
        if index == 0x6060 and self[0x6041, 0] == 0x27:
            return NOT_NOW
        if index == 0x6060 and value != 10:
            return RANGE
        if index == 0x60C2 and sub == 1 and not 2.5e-4 <= value * 10.0 ** self[0x60C2, 2] <= 0.02:
            return RANGE
        if index in PDOS or index in PDOS.values():
            return self._objection_to_pdo(index, sub, value)
        return 0

    def _objection_to_pdo(self, index, sub, value):
        communication = index if index in PDOS else {b: a for a, b in PDOS.items()}[index]
        before = self[communication, 1]
        exists = not before & OFF
        if self.local.nmt.state == "OPERATIONAL":
            return NOT_NOW
        if index in PDOS and sub == 1:
            if exists and (value ^ before) & ~OFF & 0xFFFF_FFFF:
                return NOT_NOW
            return RANGE if (value ^ before) & NO_REMOTE or value & 0x3FFF_F800 else 0
        if exists or (sub and index not in PDOS and self[index, 0]):
            return NOT_NOW
        if index in PDOS:
            return 0
        if sub:
            known = (value >> 16, value >> 8 & 0xFF) in self.types
            return 0 if known and value >> 16 in MAPPABLE else NOT_MAPPABLE
        return TOO_LONG if sum(self[index, k] & 0xFF for k in range(1, value + 1)) > 64 else 0

    # -- PDOs and the state machine ----------------------------------------------------------------
    def _mapped(self, mapping):
        return [
            (self[mapping, k] >> 16, self[mapping, k] >> 8 & 0xFF) for k in range(1, self[mapping, 0] + 1)
        ]

    def _on_rpdo(self, can_id, data, timestamp):
        with self._lock:
            self._pending = bytes(data)

    def _on_sync(self, can_id, data, timestamp):
        if self.local.nmt.state != "OPERATIONAL":
            return
        with self._lock:
            self._take(self._pending)
        for communication in (0x1800, 0x1801):
            cob = self[communication, 1]
            if cob & OFF or self[communication, 2] != 1:
                continue
            keys = self._mapped(PDOS[communication])
            payload = b"".join(struct.pack("<" + SIZES[self.types[key]], self[key]) for key in keys)
            self.network.send_message(cob & 0x7FF, payload)

    def _take(self, data):
        keys = self._mapped(0x1600)
        layout = "<" + "".join(SIZES[self.types[key]] for key in keys)
        if self[0x1400, 1] & OFF or len(data) != struct.calcsize(layout):
            return
        for key, value in zip(keys, struct.unpack(layout, data), strict=True):
            self[key] = value
        self._transition(self[0x6040, 0])
        driving = self[0x6041, 0] == 0x27 and self[0x6060, 0] == 10
        for key in ((0x6077, 0), (0x6078, 0)):
            if key in self.types:
                self[key] = self[0x6071, 0] if driving else 0

    def _transition(self, control):
        state = self[0x6041, 0]
        if state == 0x08:
            return
        if not control & 0x02:
            state = 0x40
        elif control & 0x07 == 0x06:
            state = 0x21
        elif control & 0x0F == 0x07 and state in (0x21, 0x27):
            state = 0x23
        elif control & 0x0F == 0x0F and state == 0x23:
            state = 0x27
        self[0x6041, 0] = state


def _dictionary(values):
    found = ObjectDictionary()
    for index in sorted({index for index, _ in values}):
        subs = [sub for other, sub in values if other == index]
        if subs == [0]:
            found.add_object(_variable(index, 0, *values[index, 0]))
            continue
        record = ODRecord(f"object {index:04X}", index)
        for sub in subs:
            record.add_member(_variable(index, sub, *values[index, sub]))
        found.add_object(record)
    return found


def _variable(index, sub, kind, value):
    made = ODVariable(f"{index:04X} {sub}", index, sub)
    made.data_type, made.access_type, made.value = kind, "rw", value
    return made
