"""docs/serial-protocol.md says what the code does."""

from pathlib import Path

from hw.serial import frame
from hw.simulators import serial_vectors as vectors

TEXT = (Path(__file__).parents[3] / "docs" / "serial-protocol.md").read_text()


def test_the_vectors_of_the_document_are_those_of_the_code():
    shown = TEXT.partition("<!-- vectors: begin -->\n```\n")[2].partition("```")[0]
    assert shown == "".join(f"{text}\n    {packet.hex(' ')}\n" for text, packet in vectors.vectors())


def test_every_status_bit_and_packet_type_is_in_the_document():
    for bit in frame.Status:
        assert f"({int(bit)})" in TEXT, bit
    for kind in (frame.TYPE_STATE, frame.TYPE_COMMAND):
        assert f"type 0x{kind:02x}" in TEXT
    more = frame.TYPE_STATE | frame.WITH_MOMENT, frame.TYPE_STATE | frame.WITH_VELOCITY | frame.WITH_MOMENT
    assert f"types {more[0]:02x} and {more[1]:02x}" in TEXT
