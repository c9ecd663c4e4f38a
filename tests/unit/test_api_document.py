"""docs/api.md: every public name of the client with the signature it has."""

import inspect
import re
from pathlib import Path

import pytest

from rtctl import client
from rtctl.client import Lease, RigClient, RigState, Stream
from tests.documents import client_reference as api_document

TEXT = (Path(__file__).parents[2] / "docs" / "api.md").read_text()
CLASSES = {one.__name__: one for one in (RigClient, RigState, Stream, Lease)}


@pytest.mark.parametrize("name", CLASSES)
def test_every_public_method_has_its_heading_and_a_docstring(name):
    one = CLASSES[name]
    names = [each for each in dir(one) if not each.startswith("_") and callable(getattr(one, each))]
    assert [each for each in names if f"#### `{name}.{each}`" not in TEXT] == []
    assert [each for each in names if not inspect.getdoc(getattr(one, each))] == []


def test_signatures_can_be_called_as_they_stand():
    said = dict(re.findall(r"^    (\w+)\((.*)\)(?: -> .*)?$", TEXT, re.MULTILINE))
    for name, value in api_document.public(RigClient).items():
        if isinstance(value, property):
            continue
        parameters = list(inspect.signature(value).parameters.values())[1:]
        for parameter in parameters:
            assert re.search(rf"\b{parameter.name}: ", said[name]), f"{name}: {parameter.name}"
        assert ("*, " in said[name]) == any(one.kind == one.KEYWORD_ONLY for one in parameters)


def test_a_signature_is_written_as_the_source_has_it():
    assert api_document.signature("arm", RigClient.arm).startswith(
        "arm(*, wait: bool = True, timeout_s: float = 10.0, meanwhile: Callable[[], object] = lambda: None)"
    )
    assert api_document.signature("tare", RigClient.tare) == "tare(*, hands_off: bool = False)"


def test_what_the_package_offers_is_told():
    assert [name for name in client.__all__ if f"`{name}`" not in TEXT] == []
