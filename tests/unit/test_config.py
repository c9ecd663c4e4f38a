"""Rig files: everything wrong is named, all at once, before anything moves."""

import tomllib

import pytest

from rtctl.errors import ConfigError
from rtctl.rig_file.config import Config, load

GOOD = """
schema = 1
[rig]
name = "bench"
[loop]
rate_hz = 1000
[[axis]]
name = "joint"
inertia_kgm2 = 0.012
viscous_nms_rad = 0.05
encoder_counts_per_rev = 160000
torque_constant_nm_a = 0.02
lever_m = [0.0, 0.1, 0.0]
torque_limit_nm = 1.0
torque_rate_nm_s = 200
velocity_limit_rad_s = 10
[[device]]
kind = "mock"
"""


@pytest.fixture
def write(tmp_path):
    def _write(text):
        path = tmp_path / "rig.toml"
        path.write_text(text)
        return path

    return _write


def faults(path):
    with pytest.raises(ConfigError) as caught:
        load(path)
    assert str(path) in str(caught.value)
    return caught.value.faults


def test_a_good_file_loads_with_its_hash_and_integers_count_as_floats(write):
    loaded = load(write(GOOD))
    assert loaded.config.loop.rate_hz == 1000.0
    assert loaded.config.period_s == 1e-3
    assert len(loaded.sha256) == 64
    assert loaded.config.simulated


def test_all_faults_are_reported_at_once_with_file_key_and_value(write):
    text = GOOD.replace("rate_hz = 1000", 'rate_hz = "fast"\noops = 1').replace("0.05", "nan")
    text = text.replace("torque_limit_nm = 1.0", "torque_limit_nm = -3.0")
    found = faults(write(text))
    assert len(found) == 4
    assert any("loop.rate_hz" in line and "'fast'" in line for line in found)
    assert any("loop.oops" in line and "remove it" in line for line in found)
    assert any("axis[0].viscous_nms_rad" in line for line in found)
    assert any("axis[0].torque_limit_nm" in line and "-3.0" in line for line in found)


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e400", '"5"', "true", "[1.0]"])
@pytest.mark.parametrize("key", ["inertia_kgm2 = 0.012", "velocity_limit_rad_s = 10", "rate_hz = 1000"])
def test_numbers_that_are_not_finite_numbers_are_refused(write, key, value):
    name = key.split(" = ")[0]
    (line,) = faults(write(GOOD.replace(key, f"{name} = {value}")))
    assert name in line


@pytest.mark.parametrize(
    ("key", "low", "high"), [("rate_hz = 1000", 99.9, 20000.1), ("torque_constant_nm_a = 0.02", 0, 1001)]
)
def test_bounds_are_in_the_message(write, key, low, high):
    name = key.split(" = ")[0]
    for value in (low, high):
        (line,) = faults(write(GOOD.replace(key, f"{name} = {value}")))
        assert "must be" in line
        assert str(float(value)) in line or str(value) in line


def test_inconsistent_pairs_are_named(write):
    (line,) = faults(
        write(GOOD.replace("[[device]]", "position_min_rad = 2\nposition_max_rad = 1\n[[device]]"))
    )
    assert "position_min_rad 2.0 must be below position_max_rad 1.0" in line
    (line,) = faults(write(GOOD.replace("[0.0, 0.1, 0.0]", "[0.0, 0.0, 0.0]")))
    assert "lever_m" in line


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        (
            "[axis.velocity]\ndevice_tolerance_rad_s = 1e4\n",
            "velocity.device_tolerance_rad_s 10000.0 must be below",
        ),
        ('[axis.velocity]\ndevice = "use"\n[axis.friction]\npolicy = "sign"\n', 'policy "sign" has no width'),
    ],
)
def test_a_device_velocity_that_would_prove_nothing_or_chatter_is_refused(write, tables, words):
    assert any(words in line for line in faults(write(GOOD.replace("[[device]]", tables + "[[device]]"))))


def test_two_axes_of_one_name_are_refused(write):
    axis = GOOD[GOOD.index("[[axis]]") : GOOD.index("[[device]]")]
    (line,) = faults(write(GOOD + axis))
    assert "names must differ" in line


def test_an_unknown_backend_is_refused_with_the_known_ones(write):
    (line,) = faults(write(GOOD.replace('kind = "mock"', 'kind = "mokc"')))
    assert "mokc" in line
    assert "playback" in line


def test_the_options_of_the_backend_are_validated_in_the_same_pass(write):
    found = faults(write(GOOD.replace("1000", "1e9") + "[device.options]\nnonsense = 1\n"))
    assert len(found) == 2
    assert any("device[0].options" in line and "nonsense" in line for line in found)


def test_missing_and_malformed_files_are_named(write, tmp_path):
    with pytest.raises(ConfigError, match="cannot read"):
        load(tmp_path / "absent.toml")
    with pytest.raises(ConfigError, match="not a TOML file"):
        load(write("rate = = 1"))
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ConfigError, match="not a TOML file"):
        load(path)


def test_every_number_of_the_rig_file_has_both_bounds():
    """A one-sided bound lets an infinity or an absurd value through."""
    unbounded = []

    def walk(node, where):
        if node.get("type") in ("number", "integer") and not (
            ("minimum" in node and "maximum" in node) or "enum" in node or "const" in node
        ):
            unbounded.append(where)
        for name, sub in node.get("properties", {}).items():
            walk(sub, f"{where}.{name}")
        for name, sub in node.get("$defs", {}).items():
            walk(sub, name)

    walk(Config.model_json_schema(), "")
    assert unbounded == []


def test_a_file_of_an_editor_of_windows_is_read_as_it_is(write):
    path = write("")
    path.write_bytes(b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode())
    assert load(path).config == load(write(GOOD)).config


@pytest.mark.parametrize(
    ("raw", "line"),
    [(GOOD.replace("bench", "ger\xe4t").encode("latin-1"), 4), (GOOD.encode("utf-16"), 1)],
    ids=["latin", "utf-16"],
)
def test_a_file_in_another_encoding_is_told_with_its_line_and_what_to_do(write, raw, line):
    path = write("")
    path.write_bytes(raw)
    with pytest.raises(ConfigError, match=rf"rig.toml: not a TOML file: line {line} is not UTF-8: save"):
        load(path)


def test_the_example_above_is_toml():
    assert tomllib.loads(GOOD)["axis"][0]["name"] == "joint"


@pytest.mark.parametrize(
    ("tables", "key", "text"),
    [
        ('[gateway]\nbind = "127.0.0.1"', "gateway", "rtctl keys new"),
        ('[gateway]\nbind = "*"\ncurve_dir = "keys"', "gateway", "wildcard"),
        ('[gateway]\nbind = "0.0.0.0"\ncurve_dir = "keys"', "gateway", "wildcard"),
        ('[gateway]\nbind = "localhost"\ncurve_dir = "keys"', "gateway", "not a name"),
        ('[gateway]\nbind = "224.0.0.1"\ncurve_dir = "keys"', "gateway", "no address"),
        ('[gateway]\ncurve_dir = "keys"', "gateway", "no effect"),
        ('[gateway]\nbind = "127.0.0.1"\ncurve_dir = "k"\nport = 80', "gateway.port", "1024"),
        ("[gateway]\ncurve = false", "gateway.curve", "remove it"),
        ('[telemetry]\nplotjuggler = "0.0.0.0"', "telemetry.plotjuggler", "true or false"),
        (
            '[gateway]\nbind = "127.0.0.1"\ncurve_dir = "k"\nport = 9871\n[telemetry]\nplotjuggler = true',
            "",
            "give another",
        ),
    ],
)
def test_what_would_open_the_rig_to_others_is_refused_with_its_key(write, tables, key, text):
    (line,) = faults(write(GOOD + tables))
    assert key in line
    assert text in line


def test_nothing_but_ipc_is_open_by_default_and_keys_are_found_beside_the_rig_file(write, tmp_path):
    closed = load(write(GOOD))
    assert (closed.config.gateway.bind, closed.config.telemetry.plotjuggler) == ("", False)
    assert closed.keys_folder() is None
    opened = load(write(GOOD + '[gateway]\nbind = "127.0.0.1"\ncurve_dir = "keys"'))
    assert opened.keys_folder() == tmp_path / "keys"


def test_a_view_is_switched_on_by_one_word_or_by_its_table(write):
    assert load(write(GOOD)).config.view is None
    assert load(write("view = true\n" + GOOD)).config.view.port == 8650
    assert load(write("view = false\n" + GOOD)).config.view is None
    assert load(write(GOOD + "[view]\nport = 9000\n")).config.view.port == 9000
    for wrong in ("view = 1\n", 'view = "yes"\n'):
        with pytest.raises(ConfigError) as caught:
            load(write(wrong + GOOD))
        assert any("view" in fault for fault in caught.value.faults)


def test_ports_of_one_rig_differ(write):
    both = "[telemetry]\nplotjuggler = true\nplotjuggler_port = 9000\n[view]\nport = 9000\n"
    with pytest.raises(ConfigError) as caught:
        load(write(GOOD + both))
    assert any(
        "view.port 9000 is taken by telemetry.plotjuggler_port" in fault for fault in caught.value.faults
    )


def test_the_schema_for_editors_knows_the_switches():
    jsonschema = pytest.importorskip("jsonschema")
    schema = Config.model_json_schema()
    for text in ("view = true\nrecord = true\n" + GOOD, GOOD + "[view]\nport = 9000\n"):
        jsonschema.validate(tomllib.loads(text), schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads("view = 7\n" + GOOD), schema)
