"""Rig files, models, logs and event logs that a stranger wrote: refused in a moment, by name, and harmless on
the screen.
"""

import gzip
import io
import os
import re
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner
from patience import PATIENCE_S

from hw import outside
from hw.interface import BackendError
from hw.playback.columns import read_table
from rtctl import terminal
from rtctl.check import law_plan as plan
from rtctl.check import stability_report
from rtctl.cli import cli
from rtctl.errors import ConfigError, DataError, ModelError, RtctlError
from rtctl.experiments.kept_runs import NAME, KeptRuns
from rtctl.friction import artefact
from rtctl.friction.point_reader import read_points
from rtctl.host import service_steps as service
from rtctl.recording.incident import read_incident
from rtctl.recording.reader import RecordingReader
from rtctl.rig_file.config import load
from rtctl.simulation.shipped_files import shipped_config

MOCK = shipped_config("mock.toml").read_text().replace('"friction/', f'"{shipped_config("friction")}/')
EVIL = "\x1b]0;owned\x07\x1b[2J\u202e"


def rig(tmp_path, text):
    path = tmp_path / "rig.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refused(path):
    """The refusal's lines. It comes in a moment: here, long before patience with a loaded machine ends."""
    began = time.monotonic()
    with pytest.raises(ConfigError) as error:
        load(path)
    assert time.monotonic() - began < PATIENCE_S
    return [str(error.value), *error.value.faults]


TOO_MUCH = {
    "nested lists": "x = " + "[" * 20_000 + "]" * 20_000,
    "lists of some depth": "x = " + "[" * 100 + "]" * 100,
    "nested tables": "x = " + "{a=" * 5000 + "1" + "}" * 5000,
    "a key of many parts": "a" + ".a" * 20_000 + " = 1",
    "a quoted key of many parts": '"a"' + ' . "a"' * 20_000 + " = 1",
    "a whole number of many digits": "x = " + "9" * 100_000,
    "a hexadecimal number of many digits": "x = 0x" + "f" * 100_000,
    "a date that is none": "x = 2024-13-45T99:99:99Z",
    "more than a megabyte": "#" * 2_000_000,
}


@pytest.mark.parametrize("text", TOO_MUCH.values(), ids=TOO_MUCH)
def test_a_rig_file_that_is_too_much_is_refused_by_name(tmp_path, text):
    (line,) = refused(rig(tmp_path, text + "\n" + MOCK))
    assert str(tmp_path / "rig.toml") in line
    assert len(line) < 1000


@pytest.mark.parametrize("table", ["", "[rig]", "[axis.friction]"])
def test_ten_thousand_unknown_keys_are_told_by_fifty(tmp_path, table):
    keys = "".join(f"k{k} = 1\n" for k in range(10_000))
    text = keys + MOCK if not table else MOCK.replace(f"{table}\n", f"{table}\n{keys}", 1)
    lines = refused(rig(tmp_path, text))
    assert len(lines) == 52
    assert "9950 more" in lines[-1]


def test_true_and_one_point_nought_are_no_version(tmp_path):
    for value in ("true", "1.0"):
        assert any(
            "schema" in line
            for line in refused(rig(tmp_path, MOCK.replace("schema = 1", f"schema = {value}")))
        )


@pytest.mark.parametrize("value", ["5e-324", "1e-310", "-1e-200", "9e-31"])
@pytest.mark.parametrize("key", ["stiffness_nm_rad", "viscous_nms_rad", "lowpass_hz"])
def test_numbers_nobody_means_are_refused_with_their_key(tmp_path, key, value):
    lines = MOCK.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith(f"{key} = "))
    lines[at] = f"{key} = {value}"
    assert any(key in line and "nearer to 0" in line for line in refused(rig(tmp_path, "\n".join(lines))))


def test_small_numbers_that_somebody_may_mean_are_judged_not_a_traceback(tmp_path):
    lines = MOCK.splitlines()
    for at, line in enumerate(lines):
        if line.startswith(("stiffness_nm_rad = ", "viscous_nms_rad = ")):
            text = "\n".join([*lines[:at], line.split(" = ")[0] + " = 1e-29", *lines[at + 1 :]])
            try:
                loaded = load(rig(tmp_path, text))
            except ConfigError:
                continue
            stability_report.examine(loaded).to_dict()
            plan.build(loaded)


def test_foreign_texts_in_a_refusal_have_no_control_characters(tmp_path):
    quoted = EVIL.encode("unicode_escape").decode().replace("\\x", "\\u00")
    keys = f'[rig]\n"{quoted}\\nrtctl: fine" = "{quoted}"\n'
    text = MOCK.replace("[rig]\n", keys, 1).replace('name = "mock"', f'name = "{quoted}"', 1)
    lines = refused(rig(tmp_path, text))
    assert len(lines) == 3
    assert not set("".join(lines)) & {"\x1b", "\x07", "\u202e", "\n"}


@pytest.fixture
def endless(tmp_path):
    """Paths that are files to nobody: one without an end, one that nobody writes into."""
    os.mkfifo(tmp_path / "pipe")
    return Path("/dev/zero"), tmp_path / "pipe"


@pytest.mark.timeout(120)
def test_what_is_no_file_is_not_read(tmp_path, endless):
    for path in endless:
        assert "not a regular file" in refused(path)[0]
        for read, error in ((artefact.load, ModelError), (read_points, DataError)):
            with pytest.raises(error, match="not a regular file"):
                read(path)
        with pytest.raises(BackendError, match="not a regular file"):
            read_table(path, ("a",))
        text = MOCK.replace(f'model = "{shipped_config("friction")}/mock.json"', f'model = "{path}"', 1)
        assert str(path) in text
        shown = CliRunner().invoke(cli, ["check", str(rig(tmp_path, text))])
        assert isinstance(shown.exception, ModelError)
        text = MOCK.replace("[device.options]\n", f'[device.options]\nfaults = "{path}"\n', 1)
        assert any("is not a file" in line for line in refused(rig(tmp_path, text)))
        shown = CliRunner().invoke(cli, ["events", str(path)])
        assert shown.exception is not None


@pytest.mark.timeout(120)
def test_a_pipe_in_place_of_what_rtctl_wrote_is_waited_for_by_no_command(tmp_path):
    pipe = tmp_path / "x-000.mcap"
    os.mkfifo(pipe)
    os.mkfifo(tmp_path / NAME)
    for read in (
        lambda: RecordingReader([pipe]),
        lambda: read_incident(pipe),
        lambda: KeptRuns(tmp_path, {}, resume=True),
    ):
        with pytest.raises(DataError, match="not a regular file"):
            read()


@pytest.mark.parametrize(
    "words",
    [
        "check loop",
        "check rig",
        "check model",
        "check script",
        "run loop --for 1",
        "run mock --for 1 --faults loop",
        "identify --log loop --column position=a:rad --column torque=b:Nm",
        "info loop",
        "probe port",
    ],
)
def test_a_link_to_itself_is_refused_by_name(tmp_path, words):
    loop = tmp_path / "loop"
    loop.symlink_to("loop")
    model = f'model = "{shipped_config("friction")}/mock.json"'
    port = shipped_config("serial.toml").read_text().replace("/tmp/rtctl-board", str(loop))
    texts = {
        "mock": MOCK,
        "rig": f'{MOCK}\n[record]\nfolder = "loop"\n',
        "model": MOCK.replace(model, 'model = "loop"', 1),
        "script": MOCK.replace("[device.options]\n", '[device.options]\nfaults = "loop"\n', 1),
        "port": port,
    }
    for name, text in texts.items():
        (tmp_path / name).write_text(text)
    told = [str(tmp_path / word) if word in (*texts, "loop") else word for word in words.split()]
    shown = CliRunner().invoke(cli, told)
    known = (type(None), RtctlError, SystemExit)
    assert isinstance(shown.exception, known), shown.exc_info
    assert shown.exit_code != 0 or words == "check rig"


def test_a_model_that_is_nested_or_has_numbers_nobody_means_is_refused(tmp_path):
    text = shipped_config("friction/mock.json").read_text()
    path = tmp_path / "m.json"
    for bad in (
        "[" * 100_000,
        '{"a":' * 5000,
        "[" + "9" * 10_000 + "]",
        text.replace('"intercept": ', '"intercept": 5e-324, "x": ', 1),
    ):
        path.write_text(bad)
        with pytest.raises(ModelError) as error:
            artefact.load(path)
        assert len(str(error.value)) < 1000


def test_a_packed_log_that_bursts_is_refused_and_a_packed_log_is_read(tmp_path):
    log = tmp_path / "log.csv.gz"
    log.write_bytes(gzip.compress(b"a,b\r\n" + b"0.0,1.0\r\n" * 100_000))
    assert len(read_table(log, ("a",)).columns["a"]) == 100_000
    log.write_bytes(gzip.compress(b"a\n") + gzip.compress(b"0\n" * (100 << 20)))
    with pytest.raises(BackendError, match="unpack to more than"):
        read_table(log, ("a",))


def test_an_event_log_that_somebody_else_wrote_is_shown_on_one_line_each(tmp_path):
    folder = tmp_path / "state" / "mock"
    folder.mkdir(parents=True)
    lines = ['{"event": 5}', '{"event": "fault"}', "[" * 100_000, "7",
        '{"timestamp": 1e300, "tick": 1, "event": "x"}', "\\ud800",
             '{"timestamp": 1, "tick": {}, "event": {"a": 1}}',
             '{"timestamp": 1, "tick": 1, "event": "warning", "name": "\\u001b[2J", '
                 '"text": "\\nforged"}']  # fmt: skip
    (folder / "events.jsonl").write_text("\n".join(lines) + "\n")
    done = CliRunner().invoke(
        cli, ["events", "mock", "--state-dir", str(folder.parent)], catch_exceptions=False
    )
    assert done.exit_code == 0
    assert "\x1b" not in done.output
    assert not any(line.startswith("forged") for line in done.output.splitlines())


def test_nothing_foreign_reaches_the_terminal_as_a_command(monkeypatch):
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, "utf-8", newline="\n"))
    monkeypatch.setattr(sys, "stderr", io.TextIOWrapper(io.BytesIO(), "utf-8"))
    terminal.obey_nothing_foreign()
    sys.stdout.write(f"a{EVIL}b\x9b31m\x00\x7f\tc\r\n\x1b[32mPASS\x1b[0m\udcff")
    sys.stdout.flush()
    assert raw.getvalue().decode() == (
        "a\\x1b]0;owned\\x07\\x1b[2J\\u202eb\\x9b31m\\x00\\x7f\tc\r\n\x1b[32mPASS\x1b[0m\\udcff"
    )


def test_a_long_foreign_text_is_cut():
    assert len(outside.shown("\x1b" * 10_000)) < 1000


@pytest.fixture
def to_install(tmp_path):
    """A rig file beside a secret, and beside a model that is a link to it."""
    folder = tmp_path / "rig"
    (folder / "models").mkdir(parents=True)
    (folder / "secret").write_text("root's own")
    (folder / "models" / "mock.json").write_bytes(shipped_config("friction/mock.json").read_bytes())
    return folder


def installed(folder, text):
    (folder / "rig.toml").write_text(text.replace(f'"{shipped_config("friction")}/', '"models/'))
    return {
        str(file.path): file.content
        for file in service.plan(load(folder / "rig.toml"), Path("/x"), "rtctl", start=False).files
    }


def test_the_service_copies_what_keys_name_and_no_text_that_reads_like_a_file(to_install):
    text = re.sub(r'description = ".*"', 'description = "secret"', MOCK)
    assert '"secret"' in text
    files = installed(to_install, text)
    assert "/x/etc/rtctl/models/mock.json" in files
    assert not any("secret" in name for name in files)


@pytest.mark.parametrize("way", ["file", "folder"])
def test_the_service_follows_no_link(to_install, way):
    models = to_install / "models"
    if way == "file":
        (models / "mock.json").rename(to_install / "real.json")
        (models / "mock.json").symlink_to(to_install / "real.json")
    else:
        models.rename(to_install / "elsewhere")
        models.symlink_to(to_install / "elsewhere")
    with pytest.raises(ConfigError, match="is a link"):
        installed(to_install, MOCK)


def test_a_file_is_installed_through_no_link_that_waits_there(tmp_path):
    (tmp_path / "secret").write_text("before")
    (tmp_path / ".a.new").symlink_to(tmp_path / "secret")
    service.File(tmp_path / "a", b"after").write()
    assert (tmp_path / "a").read_bytes() == b"after"
    assert (tmp_path / "secret").read_text() == "before"
