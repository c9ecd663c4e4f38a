"""Frames as the makers' own libraries build and read them, written to vectors.json beside this file.

    pip install -r tests/contract/makers/requirements.txt
    python tests/contract/makers/make_vectors.py

In an environment of its own: no test needs these packages (`test_makers_libraries.py` reads the file).
"""

import importlib.metadata
import json
import math
import socket
import struct
from pathlib import Path

PACKAGES = ("moteus", "odrive", "odrive-can", "cantools", "optoforce", "NetFT")
TORQUES_NM = (0.0, 0.25, -1.5, 0.0123)


def frame(arbitration_id, data):
    return {"id": arbitration_id, "data": bytes(data).hex()}


def moteus_replies():
    import moteus

    found = []
    for values in (
        (10, 0.25, 0.75, 0.1, 1.5, 40.0, 0),
        (1, -123.5, 0.0, 0.0, -0.25, 21.5, 33),
        (11, 0.0, -2.0, 0.0, 0.0, 30.0, 0),
    ):
        mode, position, velocity, torque, current, temperature, fault = values
        floats = (
            struct.pack("<fff", position, velocity, torque),
            struct.pack("<f", current),
            struct.pack("<f", temperature),
        )
        data = (
            bytes([0x21, 0x00, mode]) + b"\x2f\x01" + floats[0] + b"\x2d\x04" + floats[1] + b"\x2d\x0e"
            + floats[2] + bytes([0x21, 0x0F, fault])
        )  # fmt: skip
        read = moteus.parse_registers(data).response
        names = ("MODE", "POSITION", "VELOCITY", "Q_CURRENT", "TEMPERATURE", "FAULT")
        registers = [read[int(getattr(moteus.Register, name))] for name in names]
        found.append({"data": data.hex(), "read": [getattr(value, "value", value) for value in registers]})
    return found


def moteus_vectors():
    import moteus

    query = moteus.QueryResolution()
    for name in moteus.QueryResolution.__dict__:
        if not name.startswith("_"):
            setattr(query, name, moteus.IGNORE)
    query.mode = query.fault = moteus.INT8
    query.position = query.velocity = query.torque = query.q_current = query.temperature = moteus.F32
    fields = moteus.PositionResolution()
    fields.position = fields.velocity = fields.feedforward_torque = fields.kp_scale = fields.kd_scale = (
        moteus.F32
    )
    fields.maximum_torque = fields.stop_position = fields.watchdog_timeout = moteus.F32
    found = {"commands": [], "stops": [], "identities": [], "replies": moteus_replies()}
    for node, source in ((1, 0), (5, 0), (127, 126)):
        one = moteus.Controller(
            id=node,
            source_can_id=source,
            query_resolution=query,
            position_resolution=fields,
            transport=object(),
        )
        for torque in TORQUES_NM:
            made = one.make_position(
                position=math.nan, velocity=0.0, feedforward_torque=torque, kp_scale=0.0, kd_scale=0.0,
                maximum_torque=2.0, stop_position=math.nan, watchdog_timeout=0.01, query=True,
            )  # fmt: skip
            sent = frame(
                made.arbitration_id | made.source << 8 | 0x8000 * made.reply_required | made.destination,
                made.data,
            )
            found["commands"].append({"node": node, "source": source, "torque_nm": torque, **sent})
        made = one.make_stop(query=True)
        sent = frame(
            made.arbitration_id | made.source << 8 | 0x8000 * made.reply_required | made.destination,
            made.data,
        )
        found["stops"].append({"node": node, "source": source, **sent})
        made = one.make_custom_query(dict.fromkeys((0x120, 0x121, 0x122), moteus.INT32))
        found["identities"].append({"node": node, "data": bytes(made.data).hex()})
    return found


def odrive_vectors():
    import cantools
    import odrive.enums

    folder = Path(importlib.metadata.distribution("odrive-can").locate_file("odrive_can/dbc"))
    found = {}
    for version in ("0.5.6", "0.6.10"):
        base = cantools.database.load_file(folder / f"odrive-cansimple-{version}.dbc")
        found[version] = _odrive_of(base, version)
    known = odrive.enums.ODriveError
    found["errors"] = {str(int(bit)): bit.name for bit in known if bit}
    return found


def _odrive_of(base, version):
    def message(name):
        return next(one for one in base.messages if one.name == f"Axis0_{name}")

    def sent(name, **values):
        one = message(name)
        whole = {signal.name: values.get(signal.name, 0) for signal in one.signals}
        return {
            "command": one.frame_id & 0x1F,
            "length": one.length,
            "data": one.encode(whole, scaling=False).hex(),
        }

    old = version.startswith("0.5")
    state, mode = ("Set_Axis_State", "Set_Controller_Mode")
    found = {
        "commands": {
            one.name.removeprefix("Axis0_"): one.frame_id & 0x1F
            for one in base.messages
            if one.name.startswith("Axis0_")
        },
        "idle": sent(state, Axis_Requested_State=1),
        "closed_loop": sent(state, Axis_Requested_State=8),
        "torque_control": sent(mode, Control_Mode=1, Input_Mode=1),
        "clear": sent("Clear_Errors"),
        "torques": [
            {"torque_nm": torque, **sent("Set_Input_Torque", Input_Torque=torque)} for torque in TORQUES_NM
        ],
        "estimates": sent("Get_Encoder_Estimates", Pos_Estimate=-12.25, Vel_Estimate=0.5),
        "iq": sent("Get_Iq", Iq_Setpoint=3.0, Iq_Measured=-1.75),
        "heartbeat": sent("Heartbeat", Axis_Error=0x40 if old else 0x20, Axis_State=8),
    }
    errors = next(signal for signal in message("Heartbeat").signals if signal.name == "Axis_Error").choices
    found["errors"] = {str(bit): str(name) for bit, name in errors.items() if bit}
    if not old:
        found["temperature"] = sent("Get_Temperature", FET_Temperature=30.0, Motor_Temperature=41.5)
        found["version"] = sent(
            "Get_Version", Protocol_Version=2, Fw_Version_Major=0, Fw_Version_Minor=6, Fw_Version_Revision=10
        )
        found["address"] = sent("Address", Node_ID=5, Serial_Number=0x0605_0403_0201)
    return found


def optoforce_vectors():
    import optoforce
    from optoforce.reading import read_16bytes, read_22bytes, read_34bytes

    found = {"configurations": [], "frames": []}
    for rate_hz, filter_hz, zero in (
        (1000, "none", False),
        (333, 150, True),
        (30, 1.5, False),
        ("stop", 15, False),
    ):
        one, written = optoforce.OptoForce16("port", rate_hz, filter_hz, zero), []
        port = type(
            "Port",
            (),
            {
                "write": lambda self, payload, to=written: to.append(bytes(payload)),
                "close": lambda self: None,
            },
        )
        optoforce.serial.Serial = lambda *_, kind=port, **__: kind()
        one.connect()
        given = {
            "rate_hz": 0 if rate_hz == "stop" else rate_hz,
            "filter_hz": 0 if filter_hz == "none" else filter_hz,
        }
        found["configurations"].append({**given, "zero": zero, "data": written[0].hex()})
    for layout, size, read in (
        ("3-axis", 3, read_16bytes),
        ("6-axis", 6, read_22bytes),
        ("4x3-axis", 12, read_34bytes),
    ):
        values = [(-1) ** k * (100 + 17 * k) for k in range(size)]
        head = bytes((0xAA, 0x07, 0x08, 2 * size + 4))
        body = head + struct.pack(f">HH{size}h", 65_535, 1, *values)
        data = body + sum(body).to_bytes(2, "big")
        seen = read(head, data[4:])
        assert seen.valid_checksum
        found["frames"].append(
            {
                "layout": layout,
                "data": data.hex(),
                "count": seen.count,
                "status": seen.status,
                "counts": values,
            }
        )
    return found


def rdt_vectors():
    import NetFT

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as box:
        box.bind(("127.0.0.1", 49152))
        box.settimeout(5.0)
        sensor = NetFT.Sensor("127.0.0.1")
        found = {"requests": [], "records": []}
        for name, ask in (("stream", lambda: sensor.send(2, 0)), ("stop", sensor.stopStreaming)):
            ask()
            found["requests"].append({"what": name, "data": box.recv(64).hex()})
        where = sensor.sock.getsockname()
        for number, counts in ((1, (1, -2, 3, -4, 5, -6)), (0xFFFF_FFFF, (2**31 - 1, -(2**31), 0, 0, 0, 7))):
            data = struct.pack(">3I6i", number, 7 * number & 0xFFFF_FFFF, 0, *counts)
            box.sendto(data, where)
            found["records"].append({"data": data.hex(), "number": number, "read": sensor.receive()})
        sensor.sock.close()
    return found


def main():
    made = {
        "versions": {name: importlib.metadata.version(name) for name in PACKAGES},
        "moteus": moteus_vectors(),
        "odrive": odrive_vectors(),
        "optoforce": optoforce_vectors(),
        "rdt": rdt_vectors(),
    }
    Path(__file__).with_name("vectors.json").write_text(json.dumps(made, indent=1) + "\n")


if __name__ == "__main__":
    main()
