"""Every curve of the shipped PlotJuggler layout is a series that the state samples make."""

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from rtctl.host.samples import STATE_FIELDS
from rtctl.tick import FIELD

LAYOUT = Path(__file__).parents[3] / "docs" / "plotjuggler-layout.xml"
SERIES = re.compile(r"rtctl/state/(?P<field>[a-z0-9_]+)(?P<index>\[\d\])?")


def test_every_curve_names_a_field_with_an_index_exactly_where_it_is_an_array():
    curves = [curve.get("name") for curve in ET.parse(LAYOUT).iter("curve")]
    assert len(curves) >= 15
    assert len(set(curves)) == len(curves)
    for name in curves:
        found = SERIES.fullmatch(name)
        assert found, name
        assert found["field"] in STATE_FIELDS, name
        field = FIELD[found["field"]]
        assert (field.shape == "scalar") == (found["index"] is None), name


def test_the_document_names_the_layout_and_the_steps_that_prevent_crashes():
    text = (LAYOUT.parent / "plotjuggler.md").read_text()
    assert LAYOUT.name in text
    assert "**msgpack**" in text
    assert "`timestamp`" in text
