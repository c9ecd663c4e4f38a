"""Recordings that lie, burst or are damaged: a named error or what is left of them, never a traceback or a
bomb.
"""

import io
import json
import resource
import struct
import subprocess
import sys
import zipfile
from pathlib import Path

import forged_recording as forged
import numpy as np
import pytest
from click.testing import CliRunner

from rtctl.cli import cli
from rtctl.errors import DataError, RtctlError
from rtctl.recording import mcap_format as fmt
from rtctl.recording import tick_blocks
from rtctl.recording.law_arrays import unpack_law
from rtctl.recording.mcap_format import MAGIC, Op
from rtctl.recording.overview import overview
from rtctl.recording.reader import RecordingReader
from rtctl.recording.tick_cdr import MESSAGE_HEAD
from rtctl.recording.topics import COLUMNS
from rtctl.tick import new_ticks

# address space of a child that reads a bomb: the libraries alone reserve a third of it
MEMORY_BYTES = 3 << 30
ROOT = Path(__file__).parents[2]


def seen(path):
    return overview(RecordingReader([path]))


@pytest.mark.parametrize(
    "about",
    [
        {"n_axes": "4096"}, {"n_axes": "-1"}, {"n_axes": "x"}, {"n_axes": "9" * 5000}, {"n_axes": "²"},
        {"session": "x"},
        {"first_row": "-5"}, {"first_row": "x"}, {"first_row": "9" * 400}, {"period_ns": "0"},
        {"period_ns": "nan"},
        {"rate_hz": "nan"}, {"rate_hz": "0"}, {"rate_hz": "x"}, {"start_wall_ns": "9" * 30}, {"axes": "7"},
        {"axes": "[["},
        {"axes": "[" * 100_000}, {"axes": '["a", "b"]'}, {"realtime": "{}"}, {"realtime_waivers": "[[[1]]]"},
    ],
    ids=lambda about: next(f"{name}={value[:12]}" for name, value in about.items()),
)  # fmt: skip
def test_facts_with_other_numbers_are_put_right_or_said(tmp_path, about):
    path = forged.write(tmp_path / "a.mcap", about)
    assert seen(path)["ticks"] == 100
    shown = CliRunner().invoke(cli, ["info", str(path)], catch_exceptions=False)
    assert shown.exit_code == 0
    if next(iter(about)) not in ("axes", "realtime", "realtime_waivers"):
        assert "DAMAGED" in shown.output


def test_facts_that_are_lost_are_taken_from_the_ticks(tmp_path):
    path = forged.write(tmp_path / "a.mcap", about=False, first=3)
    found = seen(path)
    assert (found["ticks"], found["about"]["n_axes"]) == (100, "1")
    assert found["damaged"]


def test_what_a_recording_says_is_shown_without_what_a_terminal_obeys(tmp_path):
    evil = "m\x1b]0;owned\x07\x1b[2J\u202e\nrtctl: all is well"
    path = forged.write(
        tmp_path / "a.mcap", {"rig": evil, "version": evil, "config_file": evil, "axes": json.dumps([evil])}
    )
    shown = CliRunner().invoke(cli, ["info", str(path)], catch_exceptions=False).output
    assert "owned" in shown
    assert not set(shown) & {"\x1b", "\x07", "\u202e"}
    assert not any(line.startswith("rtctl:") for line in shown.splitlines())


def test_a_damaged_schema_hides_nothing(tmp_path):
    for schema in (b"", b"{", b"[1]", b"\xff", b'{"properties": 5}', b"[" * 50_000):
        found = seen(forged.write(tmp_path / f"{len(schema)}{schema[:1].hex()}.mcap", schema=schema))
        assert found["ticks"] == 100, schema


def test_a_flipped_bit_in_the_name_of_a_field_takes_no_field_away(tmp_path):
    """As long as its checksum says that the schema is not the one that was written."""
    for old, new in (
        (b" position_rad ", b" position_raf "),
        (b"float64[1] current_a ", b"float64[3] current_a "),
    ):
        assert forged.SCHEMA.count(old) == 1
        path = forged.write(tmp_path / f"{new[:5].hex()}.mcap", schema=forged.SCHEMA.replace(old, new))
        reader = RecordingReader([path])
        assert reader.read().rows["position_rad"][7, 0] == 1.0
        assert "schema" in reader.notes[0]
        assert not reader.missing_fields()


@pytest.mark.parametrize("columns", [False, True])
def test_one_flipped_bit_costs_at_most_the_chunk_it_is_in(tmp_path, columns):
    whole = forged.write(tmp_path / "a.mcap", chunks=4, columns=columns).read_bytes()
    path, summary = tmp_path / "b.mcap", whole.rindex(bytes([Op.DATA_END]) + struct.pack("<Q", 4))
    rng = np.random.default_rng(1)
    heads = [
        at
        for at in range(len(whole))
        if whole[at : at + 1] == bytes([Op.CHUNK]) and whole[at + 41 : at + 45] == b"zstd"
    ]
    assert len(heads) == 4
    bits = [8 * at + bit for at in heads for bit in range(72)]  # every bit of every chunk's own head
    bits += rng.integers(8 * len(MAGIC), 8 * summary, 400).tolist()
    for bit in bits:
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << bit % 8
        path.write_bytes(damaged)
        assert seen(path)["ticks"] >= 75, f"bit {bit % 8} of byte {bit // 8}"


@pytest.mark.parametrize("columns", [False, True])
def test_bytes_that_are_cut_off_anywhere_or_made_up_are_a_named_error_or_less(tmp_path, columns):
    whole = forged.write(tmp_path / "a.mcap", chunks=2, columns=columns).read_bytes()
    rng, path = np.random.default_rng(2), tmp_path / "b.mcap"
    for _ in range(150):
        damaged = bytearray(whole[: rng.integers(0, len(whole))])
        for at in rng.integers(0, max(1, len(damaged)), 20):
            if len(damaged) > at >= len(MAGIC):
                damaged[at] = rng.integers(256)
        path.write_bytes(damaged)
        try:
            seen(path)
        except RtctlError:
            continue


@pytest.mark.parametrize("claimed", [0, 10, 1 << 33, (1 << 64) - 1])
def test_a_chunk_that_lies_about_its_size_is_left_out(tmp_path, claimed):
    records, _ = forged.ticks(0, 10)
    path = forged.write(tmp_path / "a.mcap", raw=[forged.lying_chunk(claimed, records)])
    found = seen(path)
    assert (found["ticks"], found["bad_chunks"]) == (100, 1)


def test_a_message_whose_length_overflows_is_a_damaged_chunk(tmp_path):
    for length in ((1 << 63) - 1, (1 << 63) - 9, (1 << 64) - 1, 1 << 40):
        records = struct.pack("<BQ", Op.MESSAGE, length) + bytes(40)
        found = seen(
            forged.write(tmp_path / f"{length}.mcap", raw=[forged.lying_chunk(len(records), records)])
        )
        assert (found["ticks"], found["bad_chunks"]) == (100, 1)


def test_ticks_of_another_kind_are_a_damaged_chunk(tmp_path):
    for text in (b"7", b"[]", b"{", b'{"position_rad": "x"}', b'{"position_rad": [1, 2, 3]}',
        b'{"tick": 1e400}', b'{"tick": -1}',
                 b'{"tick": {"a": 1}}', b"[" * 2000, b"\xff\xfe"):  # fmt: skip
        records = fmt.message(1, 0, 5, text)
        found = seen(forged.write(tmp_path / "a.mcap", raw=[forged.lying_chunk(len(records), records)]))
        assert found["ticks"] in (100, 101), text
        (tmp_path / "a.mcap").unlink()


LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, ({most}, {most}))
from rtctl.cli import main
sys.argv = ["rtctl", *sys.argv[1:]]
main()
"""


def in_little_memory(*arguments):
    code = LIMITED.format(most=MEMORY_BYTES)
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        capture_output=True, text=True, timeout=200, check=False, cwd=ROOT,
    )  # fmt: skip


def test_a_small_file_that_unpacks_to_gigabytes_is_read_in_little_memory(tmp_path):
    bomb = forged.lying_chunk(3200 << 20, packed=forged.zeros(3200 << 20))
    many = [forged.lying_chunk(100 << 20, packed=forged.zeros(100 << 20))] * 32
    for name, raw in (("one", [bomb]), ("many", many)):
        path = forged.write(tmp_path / f"{name}.mcap", raw=raw)
        assert path.stat().st_size < 1 << 20
        done = in_little_memory("info", path, "--json")
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["ticks"] == 100
        assert json.loads(done.stdout)["bad_chunks"] == len(raw)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 1 << 21  # KiB


def test_a_block_whose_columns_make_gigabytes_of_ticks_is_left_out(tmp_path):
    many = new_ticks(1 << 20, 1)  # 8 MB as columns, 700 MB as ticks
    block = tick_blocks.encode(many, COLUMNS, 0, 0)
    raw = [forged.lying_chunk(k * len(block), block * k) for k in (1, 8)]
    path = forged.write(tmp_path / "a.mcap", raw=raw, columns=True)
    assert path.stat().st_size < 1 << 18
    done = in_little_memory("info", path, "--json")
    assert done.returncode == 0, done.stderr
    assert (json.loads(done.stdout)["ticks"], json.loads(done.stdout)["bad_chunks"]) == (100, 2)


def test_words_of_a_block_that_are_made_up_are_a_damaged_chunk_or_other_numbers(tmp_path):
    records, _ = forged.ticks(0, 25, columns=True)
    rng, path = np.random.default_rng(4), tmp_path / "a.mcap"
    for _ in range(150):
        made = bytearray(records)
        for at in rng.integers(MESSAGE_HEAD, len(made), 3):
            made[at] = rng.integers(256)
        found = seen(forged.write(path, raw=[forged.lying_chunk(len(made), bytes(made))], columns=True))
        assert found["ticks"] - 100 in (0, 25)
        path.unlink()


def npz(head, data=b"", name="params.x.npy"):
    """An npz of one array with a head of one's own."""
    text = str(head).encode().ljust(117) + b"\n"
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(name, b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + data)
    return packed.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        npz({"descr": "<f8", "fortran_order": False, "shape": (10**12,)}),
        npz({"descr": "<f8", "fortran_order": False, "shape": (-1, 5)}),
        npz({"descr": "|O", "fortran_order": False, "shape": (1,)}, b"cos\nsystem\n"),
        npz({"descr": "<f8", "fortran_order": False, "shape": (1 << 28,)}, bytes(1 << 26)),
        npz("__import__('os')"),
        b"PK\x05\x06" + bytes(10), b"", b"PK",
    ],
)  # fmt: skip
def test_an_attachment_is_bounded_before_it_is_built(tmp_path, content):
    with pytest.raises(DataError):
        unpack_law(content, 1)
    path = forged.write(tmp_path / "a.mcap", attachments={"law.npz": content})
    assert seen(path)["ticks"] == 100
    replay = CliRunner().invoke(cli, ["replay", str(path)])
    assert isinstance(replay.exception, DataError)


def test_parts_that_cannot_be_read_are_left_out_and_told(tmp_path):
    parts = [tmp_path / f"mock-0-7-00{k}.mcap" for k in range(4)]
    parts[0].touch()  # what a full disk left of the first one
    forged.write(parts[1], chunks=1)
    parts[2].write_bytes(b"\0" * 5000)
    forged.write(parts[3], chunks=1, first=25)
    found = overview(RecordingReader(parts))
    assert found["ticks"] == 50
    assert set(found["left_out"]) == {str(parts[0]), str(parts[2])}
    shown = CliRunner().invoke(cli, ["info", str(parts[3])], catch_exceptions=False).output
    assert shown.count("LEFT OUT") == 2
