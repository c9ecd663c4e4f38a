"""Backends are found by name, and what is missing for one is named with what to install."""

import json
import math
import sys
from importlib.metadata import EntryPoint
from pathlib import Path
from types import SimpleNamespace

import in_process
import pytest

from hw import registry
from hw.interface import BackendError, BackendInfo, Joint, Timing
from rtctl.host import probe_device_readings


def test_a_missing_driver_is_named_with_the_package_that_brings_it(monkeypatch):
    for name in [
        name for name in sys.modules if name.split(".")[0] == "serial" or name.startswith("hw.serial_port")
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "hw.force.serial_backend", raising=False)
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(BackendError, match=r"pip install 'rtctl\[serial\]'"):
        registry.create("rokubi", {}, None)


def test_a_missing_module_of_a_third_party_is_named_as_it_is(monkeypatch):
    info = BackendInfo("no_such_module_here.backend:Thing", "no_such_module_here:Options", True)
    monkeypatch.setitem(registry.BUILT_IN, "odd", info)
    registry.lookup.cache_clear()
    with pytest.raises(BackendError, match="pip install 'no_such_module_here'"):
        registry.options_model("odd")
    registry.lookup.cache_clear()


@pytest.mark.parametrize(
    ("offered", "said"),
    [
        ([], r"no backend 'odd'; there are: .*serial-lines; .*install that into "),
        (
            ["no_such_module_here:INFO"],
            "'odd' of a package cannot be loaded: No module named 'no_such_module_here'",
        ),
        (["hw.interface:NO_SUCH_INFO"], "cannot be loaded: .*NO_SUCH_INFO.*; install a package again"),
    ],
)
def test_a_third_partys_backend_that_is_not_there_is_named_with_where_to_install_it(
    monkeypatch, offered, said
):
    made = [EntryPoint("odd", value, registry.GROUP) for value in offered]
    monkeypatch.setattr(registry, "entry_points", lambda group: made)
    registry.lookup.cache_clear()
    with pytest.raises(BackendError, match=said):
        registry.lookup("odd")
    registry.lookup.cache_clear()


@pytest.mark.parametrize(
    ("text", "target", "said"),
    [
        ("INFO = BackendInfo()", None, r"'odd' cannot be loaded: NameError: .*__init__\.py:1\)"),
        (None, "odd_board.options:Options", "its package has no module odd_board.options"),
        ("1 / 0", "odd_board:Options", r"cannot be loaded: ZeroDivisionError: .*__init__\.py:1\)"),
        ("Options = 3", "odd_board:Options", "odd_board:Options is no pydantic model"),
        ("Other = 3", "odd_board:Options", "cannot be loaded: AttributeError: .*Options"),
    ],
)
def test_a_mistake_in_a_third_partys_package_is_named_with_its_line(
    monkeypatch, tmp_path, text, target, said
):
    (tmp_path / "odd_board").mkdir()
    (tmp_path / "odd_board/__init__.py").write_text(text or "")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "odd_board", raising=False)
    made = [EntryPoint("odd", "odd_board:INFO", registry.GROUP)]
    monkeypatch.setattr(registry, "entry_points", lambda group: made)
    if target:
        monkeypatch.setitem(registry.BUILT_IN, "odd", BackendInfo("x:y", target, True))
    registry.lookup.cache_clear()
    with pytest.raises(BackendError, match=said):
        registry.options_model("odd")
    registry.lookup.cache_clear()
    sys.modules.pop("odd_board", None)


def test_whatever_the_making_of_a_driver_raises_is_told_as_a_driver_that_cannot_be_made(monkeypatch):
    info = BackendInfo("builtins:int", "x:y", True)
    monkeypatch.setattr(registry, "lookup", lambda _kind: info)
    with pytest.raises(BackendError, match="builtins:int cannot be made: TypeError: "):
        registry.create("odd", {}, None)


GIVEN = []


def declared(_options, _rig):
    """What somebody's package says of its joint, or of its delay."""
    return (one if isinstance(one, (Joint, Timing, type(None))) else 1 / 0 for one in GIVEN)


@pytest.mark.parametrize("given", [
    [], [None], [Joint(), Joint()], [Timing()], [1.0], [Joint(motor_share=math.nan)],
    [Joint(dry_share=1.1)], [Joint(motor_share=-0.1)], [Joint(link_inertia_share=math.inf)],
    [Joint(damping_nms_rad=math.nan)], [Joint(damping_nms_rad=None)], [Joint(encoder="lnik")],
])  # fmt: skip
def test_a_joint_that_no_proof_may_rest_on_is_refused(monkeypatch, given):
    info = BackendInfo("x:y", "x:y", True, joint=f"{__name__}:declared")
    monkeypatch.setattr(registry, "lookup", lambda _kind: info)
    monkeypatch.setattr(sys.modules[__name__], "GIVEN", given)
    with pytest.raises(BackendError, match=f"{__name__}:declared"):
        registry.joint("odd", {}, SimpleNamespace(n_axes=1))
    monkeypatch.setattr(sys.modules[__name__], "GIVEN", [Joint(0.25, 0.5, 0.01, "link", 80.0, 0.3)])
    assert registry.joint("odd", {}, SimpleNamespace(n_axes=1)) == GIVEN


def test_a_declaration_that_raises_is_told_as_the_devices(monkeypatch):
    info = BackendInfo("x:y", "x:y", True, timing=f"{__name__}:declared")
    monkeypatch.setattr(registry, "lookup", lambda _kind: info)
    monkeypatch.setattr(sys.modules[__name__], "GIVEN", [2.0])
    with pytest.raises(BackendError, match="declared: ZeroDivisionError: "):
        registry.timing("odd", {}, SimpleNamespace(n_axes=1))


def test_probe_names_a_driver_that_cannot_be_made(monkeypatch, capsys):
    def devices(*_given, **_more):
        raise BackendError("x:y cannot be made")

    monkeypatch.setattr(probe_device_readings, "devices", devices)
    config = Path(__file__).parents[3] / "configs" / "mock.toml"
    code, said, _ = in_process.run(monkeypatch, capsys, "probe", config, "--for", "0.1", "--json")
    told = json.loads(said)
    assert (code, told["error"], told["exit_code"]) == (6, "DeviceError", 6)
    assert told["message"].endswith("x:y cannot be made")
