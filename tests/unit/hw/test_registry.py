"""Backends are found by name, and what is missing for one is named with what to install."""

import sys

import pytest

from hw import registry
from hw.interface import BackendError, BackendInfo


def test_a_missing_driver_is_named_with_the_package_that_brings_it(monkeypatch):
    for name in [
        name for name in sys.modules if name.split(".")[0] == "serial" or name.startswith("hw.serial.port")
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.delitem(sys.modules, "hw.force.serial_sensor", raising=False)
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
