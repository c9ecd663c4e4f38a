"""Bota Systems' own driver at a pty where this program plays the sensor: what it sends, and what it reads.
Writes bota.json beside this file.

    pip install -r tests/contract/makers/requirements.txt
    python tests/contract/makers/make_bota.py          (twenty seconds)

The sensor sends random frames with a right checksum, and between them the same frames with one flipped bit,
whose time stamps are odd.
"""

import json
import os
import pty
import select
import struct
import time
import tty
from importlib import metadata
from pathlib import Path

import random_frames
from random_frames import DAMAGED, sealed

FRAMES, PERIOD_S = 120, 0.004


def play(master, told):
    """The sensor, in a process of its own: the driver holds Python's lock while it waits. Writes what it
    hears to `told`.
    """
    bodies, running, at, due = [body for body, _ in random_frames.chunk("rokubi", 0)], False, 0, 0.0
    while True:
        if select.select([master], [], [], 1e-3)[0]:
            heard = os.read(master, 4096)
            os.write(told, heard)
            for line in heard.split():
                running = {b"R": True, b"C": False}.get(line, running)
                os.write(master, b"r,0," + line[:1] + b",0\r\n")
        if running and time.monotonic() > due:
            due, body = time.monotonic() + PERIOD_S, bodies[at % len(bodies)]
            at += 1
            wrong = bytearray(
                sealed(body[:26] + struct.pack("<If", struct.unpack_from("<I", body, 26)[0] | DAMAGED, 25.0))
            )
            wrong[3 + at % 24] ^= 1 << at % 8
            os.write(master, sealed(body) + (bytes(wrong) if at % 4 == 0 else b""))


def configured(path):
    import bota_driver

    config, wire = bota_driver.BotaDriverConfig(), bota_driver.BotaBinaryCommunicationInterfaceConfig()
    config.communication_interface_name = "Bota_Binary_gen0"
    config.product_name, config.serial_number = "BFT-SENS-SER-M8", "SN000001"
    wire.com_port, wire.baudrate = path, 460_800
    filtered, how = bota_driver.Gen0SensorOperationConfig(), bota_driver.DriverOperationConfig()
    filtered.sinc_length, how.skip_metadata_reading = 512, True
    config.binary_communication_interface_params, config.gen0_sensor_operation_params = wire, filtered
    config.driver_operation_params = how
    return bota_driver.BotaDriver(config)


def main():
    master, slave = pty.openpty()
    tty.setraw(slave)
    hear, told = os.pipe()
    sensor = os.fork()
    if sensor == 0:
        play(master, told)
    try:
        driver = configured(os.ttyname(slave))
        assert driver.configure()
        assert driver.activate()
        frames = [driver.read_frame_blocking() for _ in range(FRAMES)]
        driver.deactivate()
        driver.shutdown()
        time.sleep(0.1)
        commands = [line + "\n" for line in os.read(hear, 1 << 16).decode().splitlines()]
    finally:
        os.kill(sensor, 9)
    read = {
        int(frame.timestamp): {"six": [*frame.force, *frame.torque], "status": frame.status.val}
        for frame in frames
    }
    made = {
        "version": metadata.version("bota-driver"),
        "commands": commands,
        "read": [{"stamp_us": stamp, **one} for stamp, one in sorted(read.items())],
    }
    Path(__file__).with_name("bota.json").write_text(json.dumps(made) + "\n")


if __name__ == "__main__":
    main()
