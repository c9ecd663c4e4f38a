"""What devices say of themselves, in words: drives by axis, boards and sensors as a whole, rigs of
several.
"""

import struct

import numpy as np
import pytest
from rig_fakes import drive_and_finger, known, read, rig

from hw.can import cia402, names, odrive_codec
from hw.can.drive_backend import Cia402Backend, OdriveBackend
from hw.can.options import Cia402Options, OdriveOptions
from hw.force import optoforce, rokubi
from hw.force.reading import Reading
from hw.force.sample import ForceSample
from hw.interface import LinkFault, LinkLost, SpeakingBackend
from hw.rig import said

BUS = {"interface": "virtual", "channel": "words"}
DEVICE, LOST = int(LinkFault.DEVICE), int(LinkFault.LOST)


def drives(backend, model, n_axes=2, **axis):
    given = {"bus": BUS, "axis": [{"node": 1 + k, **axis} for k in range(n_axes)]}
    return backend(model.model_validate(given).model_dump(mode="json"), rig(n_axes))


def handlers(backend):
    return {key: value for drive in backend.drives for key, value in drive.handlers().items()}


def test_an_odrive_names_state_and_errors_and_the_axis_they_are_of():
    backend = drives(OdriveBackend, OdriveOptions)
    assert isinstance(backend, SpeakingBackend)
    beat = struct.pack("<IBBBB", 0x200 | 0x1000000, 1, 0, 0, 0)
    handlers(backend)[odrive_codec.can_id(2, odrive_codec.HEARTBEAT)](beat, 0, 8)
    first, second = backend.words()
    assert (first.faults, second.faults) == (0, DEVICE)
    assert "IDLE" in second.text
    assert "DC_BUS_UNDER_VOLTAGE, WATCHDOG_TIMER_EXPIRED" in second.text
    assert "node 1" in first.text


def test_a_canopen_drive_names_its_state_and_its_emergency():
    backend = drives(Cia402Backend, Cia402Options)
    on = handlers(backend)
    on[cia402.EMERGENCY + 2](bytes([0x20, 0x32, 0x04, 0, 0, 0, 0, 0]), 0, 8)
    on[cia402.TPDO1 + 2](cia402.FEEDBACK.pack(0x08, 0, 0), 0, cia402.FEEDBACK.size)
    first, second = backend.words()
    assert (first.faults, second.faults) == (0, DEVICE)
    assert "fault, emergency 0x3220 (DC link under-voltage)" in second.text


def test_of_several_drives_the_one_whose_frames_do_not_come_is_silent():
    backend = drives(Cia402Backend, Cia402Options)
    on = handlers(backend)
    backend._silent = 5
    on[cia402.TPDO1 + 1](cia402.FEEDBACK.pack(0x21, 0, 0), 0, cia402.FEEDBACK.size)
    assert [word.silent for word in backend.words()] == [False, True]
    backend._silent = 0  # a whole sample has just been taken: nobody is missing
    assert not any(word.silent for word in backend.words())


def test_emergency_codes_are_named_by_code_or_class_and_others_stay_numbers():
    assert names.emergency_name(0x8130) == "0x8130 (heartbeat or life guard lost)"
    assert names.emergency_name(0x4212) == "0x4212 (device temperature)"
    assert names.emergency_name(0x81FF) == "0x81ff (communication)"
    assert names.emergency_name(0xFF01) == "0xff01 (of this manufacturer)"
    assert names.emergency_name(0x0001) == "0x0001"


def test_force_sensors_name_the_flags_of_their_status():
    assert rokubi.explain(2 | 4) == "OVERRANGE, INVALID"
    assert optoforce.explain(optoforce.OVERLOAD & 0x0100) == "OVERLOAD (0x0100)"
    sample = ForceSample(np.eye(3))
    assert sample.take(Reading(1, 2, (0.0, 0.0, 0.0))) == LinkFault.DEVICE
    assert sample.status == 2
    sample.take(Reading(2, 0, (0.0, 0.0, 0.0)))
    assert sample.status == 0


def test_of_a_rig_of_several_devices_each_is_named_with_its_own_faults_and_silence():
    with known():
        backend, _drive, finger = drive_and_finger()
        tick = read(backend)
        told = {one.label: (one.faults, one.stale) for one in said(backend, (), tick, stale=True)}
        assert told == {"device 'drive'": (0, False), "device 'finger'": (0, False)}
        finger.faults, finger.fresh = LOST, False
        for _ in range(4):
            tick["tick"] += 1
            backend.read(tick)
        told = {one.label: (one.faults, one.stale) for one in said(backend, (), tick, stale=False)}
        assert told == {"device 'drive'": (0, False), "device 'finger'": (LOST, True)}


def test_a_device_whose_read_raises_is_the_one_that_is_lost():
    def unplug():
        raise LinkLost("unplugged")

    with known():
        backend, drive, _finger = drive_and_finger()
        tick = read(backend)
        drive.on["read"] = unplug
        with pytest.raises(LinkLost):
            read(backend, tick)
        told = {one.label: one.faults for one in said(backend, (), tick, stale=False)}
        assert told == {"device 'drive'": LOST, "device 'finger'": 0}
