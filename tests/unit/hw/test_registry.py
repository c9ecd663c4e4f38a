"""Backends are found by name, and what is missing for one is named with what to install."""

import sys
from importlib.metadata import EntryPoint

import pytest

from hw import registry
from hw.interface import BackendError, BackendInfo


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
    info = BackendInfo("no_such_module_here.backend:Thing", "no_such_module_here:Options", True, "")
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
