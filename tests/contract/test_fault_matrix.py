"""Every fault x every phase of the rig's life x every backend that can be scripted: the exact tick of the
reaction.

The rig is brought into a phase (soft start, full authority with torque, HOLD, the middle of a ramp, the test
pulse), the fault begins at a known tick, and the reaction must come in the tick the contract names: not
later, and not earlier either. On the serial board the samples come over a pty from another process.
"""

import math

import can_rows
import pytest
import serial_boards
from matrix_rig import Rig, edited, enter, expect

from rtctl.control.vocabulary import Fault, State
from rtctl.simulation.shipped_files import shipped_config

PUSH_NM = 1.4
V_MAX_RAD_S = 6.0
CHECK = ("band_counts = 1.0\n", 'band_counts = 1.0\ndevice = "check"\n')
VELOCITY_OFF_RAD_S = 0.95 * V_MAX_RAD_S

KINDS = {
    # (channel, kind): (fault, ticks from the first bad one to the reaction, that one counted, value)
    ("position", "nan"): (Fault.BAD_SAMPLE, 3, 0.0),
    ("position", "inf"): (Fault.BAD_SAMPLE, 3, 1.0),
    ("position", "out_of_range"): (Fault.BAD_SAMPLE, 3, 1e6),
    ("position", "jump"): (Fault.JUMP, 2, 1.0),
    ("current", "nan"): (Fault.BAD_SAMPLE, 3, 0.0),
    ("current", "inf"): (Fault.BAD_SAMPLE, 3, -1.0),
    ("current", "offset"): (Fault.ACTUATOR_WRONG, 1, 4.0),
    ("force", "nan"): (Fault.BAD_SAMPLE, 3, 0.0),
    ("force", "saturated"): (Fault.BAD_SAMPLE, 3, 1e5),
    ("link", "stale"): (Fault.STALE, 3, 0.0),
    ("link", "drop"): (Fault.STALE, 3, 0.0),
    ("link", "sequence"): (Fault.STALE, 3, 0.0),
    ("link", "older"): (Fault.STALE, 3, 100.0),
    ("link", "checksum"): (Fault.CHECKSUM, 3, 0.0),
    ("link", "lost"): (Fault.LINK_LOST, 1, 0.0),
    ("link", "raise_read"): (Fault.LINK_LOST, 1, 0.0),
    ("link", "raise_write"): (Fault.LINK_LOST, 2, 0.0),
    ("estop", "pressed"): (Fault.ESTOP, 1, 0.0),
    ("temperature", "value"): (Fault.OVERTEMPERATURE, 1, 95.0),
    ("temperature", "missing"): (Fault.OVERTEMPERATURE, 3, 0.0),
    ("velocity", "nan"): (Fault.VELOCITY, 3, 0.0),
    ("velocity", "inf"): (Fault.VELOCITY, 3, -1.0),
    ("velocity", "out_of_range"): (Fault.VELOCITY, 3, 1e6),
    # in range: 9.5 of the 16 tolerances of the window in the first tick, 18.4 in the second
    ("velocity", "offset"): (Fault.VELOCITY, 4, VELOCITY_OFF_RAD_S),
}
ACTUATOR = {
    # judged while 75 % of the limit leave: the current shows the last period's torque, so one tick later
    "dead": (Fault.ACTUATOR_WRONG, 2, 0.0),
    "scale": (Fault.ACTUATOR_LAG, 21, 0.6),
}
PLAYED = [
    key
    for key in KINDS
    if key[0] in ("position", "current", "force", "link") and key != ("current", "offset")
]
MEASURED = [*PLAYED, *(key for key in KINDS if key[0] == "velocity")]
STATE_BYTES = 49
PHASES = ["test pulse", "soft start", "active", "hold", "stopping"]
UNDER_WAY = ["soft start", "active", "stopping"]


def in_turn(keys):
    """Every kind in these phases: in one of them in `make test`, another one for the next kind, and in all as
    volume.
    """
    return [
        pytest.param(
            *(key, phase),
            id=f"{'.'.join(key)}-{phase}",
            marks=[] if k % len(UNDER_WAY) == n else [pytest.mark.volume],
        )
        for k, key in enumerate(keys)
        for n, phase in enumerate(UNDER_WAY)
    ]


@pytest.fixture
def mock_rig(tmp_path):
    path = edited(
        tmp_path,
        "mock.toml",
        ('model = "friction/mock.json"', 'model = ""'),
        ('kind = "sine"', 'kind = "rest"'),
        ("[axis.coupling]", "[axis.temperature]\nsensor = true\n\n[axis.coupling]"),
        ("stiffness_nm_rad = 5.0", "stiffness_nm_rad = 1000.0"),
        ('realtime = "prefer"', 'realtime = "require"'),
        CHECK,
        ("[device.options.force]", "[device.options.velocity]\nnoise_rad_s = 0.01\n\n[device.options.force]"),
    )
    return Rig(path)


@pytest.fixture
def playback_rig(tmp_path):
    rows = "\n".join(f"{k / 1000!r},{1e-5 * math.sin(k / 50)!r},0.0,0.0" for k in range(4000))
    (tmp_path / "log.csv").write_text("t,x,q,h\n" + rows + "\n")
    text = shipped_config("mock.toml").read_text()
    text = text[: text.index("[[device]]")].replace('model = "friction/mock.json"', 'model = ""')
    text += (
        '[[device]]\nkind = "playback"\n[device.options]\nfile = "log.csv"\ntime = { column = "t" }\n'
        '[[device.options.axis]]\nposition = { column = "x" }\nmotor_torque = { column = "q" }\n'
        'hand_torque = { column = "h" }\n'
    )
    path = tmp_path / "play.toml"
    path.write_text(text)
    return Rig(path)


@pytest.fixture(scope="module")
def board(tmp_path_factory):
    yield lambda: serial_boards.board(1, tmp_path_factory.mktemp, "matrix", velocity=True)
    serial_boards.close_all()


@pytest.fixture
def serial_rig(tmp_path, board):
    text = shipped_config("mock.toml").read_text()
    text = text[: text.index("[[device]]")].replace('model = "friction/mock.json"', 'model = ""')
    text = text.replace("[axis.coupling]", "[axis.coupling]\ndelay_ticks = 2").replace(*CHECK)
    text += f'[[device]]\nkind = "serial"\n[device.options]\nport = "{board().port}"\nopen_timeout_s = 30.0\n'
    text += 'channels = ["current", "force", "velocity", "temperature", "estop"]\n'
    path = tmp_path / "serial.toml"
    path.write_text(text)
    made = Rig(path, lambda backend: serial_boards.InLockstep(backend, STATE_BYTES))
    yield made
    made.backend.close()


@pytest.fixture
def can_rig(tmp_path):
    text = shipped_config("mock.toml").read_text()
    text = text[: text.index("[[device]]")].replace('model = "friction/mock.json"', 'model = ""')
    text = text.replace("[axis.coupling]", "[axis.coupling]\ndelay_ticks = 2").replace(*CHECK)
    text = text.replace("[loop]", 'absent = ["force"]\n\n[loop]')
    text = text.replace(
        "torque_constant_nm_a = 0.0134", f"torque_constant_nm_a = {can_rows.TORQUE_CONSTANT_NM_A}"
    )
    bus = can_rows.bus(())
    text += '[[device]]\nkind = "odrive"\n[device.options]\nheartbeat_ms = 10.0\n'
    text += f'[device.options.bus]\ninterface = "virtual"\nchannel = "{bus["channel"]}"\n'
    text += "[[device.options.axis]]\nnode = 1\n"
    path = tmp_path / "can.toml"
    path.write_text(text)
    made = Rig(path, lambda backend: can_rows.WithDevice(backend, {"bus": bus}, "odrive", 1, ()))
    yield made
    made.backend.release()


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("key", KINDS, ids=lambda key: ".".join(key))
def test_mock(mock_rig, key, phase):
    fault, within, value = KINDS[key]
    enter(mock_rig, phase)
    mock_rig.fault_now(*key, value)
    expect(mock_rig, phase, fault, within)


@pytest.mark.parametrize(("key", "phase"), in_turn(PLAYED))
def test_playback(playback_rig, key, phase):
    fault, within, value = KINDS[key]
    enter(playback_rig, phase)
    playback_rig.fault_now(*key, value)
    expect(playback_rig, phase, fault, within)


@pytest.mark.parametrize(("key", "phase"), in_turn(MEASURED))
def test_serial_board(serial_rig, key, phase):
    fault, within, value = KINDS[key]
    enter(serial_rig, phase)
    serial_rig.fault_now(*key, value)
    expect(serial_rig, phase, fault, within)


@pytest.mark.parametrize(("key", "phase"), in_turn([key for key in MEASURED if key[0] != "force"]))
def test_can_drive(can_rig, key, phase):
    fault, within, value = KINDS[key]
    enter(can_rig, phase)
    can_rig.fault_now(*key, value)
    expect(can_rig, phase, fault, within)


@pytest.mark.parametrize("value", [50.0, -50.0])
@pytest.mark.parametrize("phase", PHASES)
def test_a_force_exactly_at_its_limit(mock_rig, phase, value):
    enter(mock_rig, phase)
    mock_rig.fault_now("force", "saturated", value)
    if phase == "stopping":  # it ramps down already
        mock_rig.run(3)
        assert mock_rig.faults & Fault.FORCE_CLIPPED
        return
    expect(mock_rig, phase, Fault.FORCE_CLIPPED, 3)


@pytest.mark.parametrize("kind", ["dead", "scale"])
def test_a_motor_that_does_not_follow(mock_rig, kind):
    fault, within, value = ACTUATOR[kind]
    enter(mock_rig, "active")
    assert abs(mock_rig["torque_applied_nm"]) == pytest.approx(PUSH_NM, abs=0.2)
    mock_rig.fault_now("actuator", kind, value)
    expect(mock_rig, "active", fault, within)


@pytest.mark.parametrize("key", [("actuator", "sign"), ("position", "sign"), ("current", "sign")], ids=str)
def test_what_is_wired_the_wrong_way_round_is_found_by_the_test_pulse(mock_rig, key):
    mock_rig.backend.params["hand_stiffness_nm_rad"] = 0.0  # nobody holds it
    mock_rig.run(900)
    mock_rig.fault_now(*key, 0.0)
    mock_rig.run(5)
    mock_rig.ask("arm_count")
    mock_rig.run(80)
    assert mock_rig.mode is State.ARMING
    mock_rig.run(1)
    assert mock_rig.mode is State.FAULT
    assert mock_rig.faults == Fault.WIRING


def test_late_ticks(mock_rig):
    enter(mock_rig, "active")

    def late(slots):
        mock_rig.tick["tick"] += slots
        mock_rig.tick["missed_ticks"] += slots
        mock_rig.run(1)

    late(1)
    late(1)
    assert mock_rig.mode is State.ACTIVE
    late(1)
    assert mock_rig.mode is State.STOPPING
    assert mock_rig.faults == Fault.OVERRUN


def test_a_standstill(mock_rig):
    enter(mock_rig, "active")
    mock_rig.tick["tick"] += 10
    mock_rig.tick["missed_ticks"] += 10
    mock_rig.run(1)
    assert mock_rig.mode is State.FAULT
    assert mock_rig.faults & Fault.STALLED
    assert mock_rig["torque_applied_nm"] == 0.0


def test_every_fault_of_the_table_has_its_place_in_some_test():
    here = {fault for fault, *_ in [*KINDS.values(), *ACTUATOR.values()]}
    here |= {Fault.WIRING, Fault.OVERRUN, Fault.STALLED, Fault.FORCE_CLIPPED}
    elsewhere = {
        Fault.END_OF_LOG: "tests/unit/hw, playback",
        Fault.OVERSPEED: "test_state_sequences",
        Fault.LAW_NOT_FINITE: "test_gate",
        Fault.PASSIVITY: "test_passivity",
        Fault.PASSIVITY_GROSS: "test_passivity",
        Fault.TARGET_LOST: "test_renderer_sequences",
        Fault.HOST_SILENT: "test_host_silence",
        Fault.OVERTORQUE: "test_gate",
        Fault.GATE: "test_gate",
        Fault.ARMING_MOVED: "test_arming",
        Fault.REALTIME: "test_state_sequences",
        Fault.DEVICE: "test_state_sequences",
        Fault.CURRENT: "test_delay_on_the_mock",
        Fault.DELAY: "test_delay_on_the_mock",
        Fault.SAMPLE_AGE: "test_delay_on_the_mock",
        Fault.FORCE_FROZEN: "test_force_that_lies",
        Fault.FORCE_OFFSET: "test_force_that_lies",
        Fault.OFF_AXIS: "test_six_components",
    }
    assert here | set(elsewhere) == set(Fault)
