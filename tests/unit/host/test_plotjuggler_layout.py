"""The shipped PlotJuggler layout: of the form the program writes, and every curve a series that the state
samples make.
"""

import xml.etree.ElementTree as ET
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.host.exchange.samples import state_samples
from rtctl.tick import tick_dtype

LAYOUT = Path(__file__).parents[3] / "docs" / "plotjuggler-layout.xml"
TOPIC = "rtctl/state"


@pytest.fixture(scope="module")
def root():
    return ET.parse(LAYOUT).getroot()


def series(sample):
    """Names PlotJuggler gives to the numbers of one message: `topic/key`, `topic/key[i]` of an array."""
    for name, value in sample.items():
        if isinstance(value, list):
            yield from (f"{TOPIC}/{name}[{at}]" for at in range(len(value)))
        else:
            yield f"{TOPIC}/{name}"


@pytest.mark.parametrize("axes", [1, 2])
def test_every_curve_is_a_series_of_a_published_sample(root, axes):
    rig = SimpleNamespace(virtual=False, start_wall_ns=0, session=1)
    (sample,) = state_samples(np.zeros(1, tick_dtype(axes)), rig, 0, 0)
    curves = [curve.get("name") for curve in root.iter("curve")]
    assert len(curves) >= 15
    assert len(set(curves)) == len(curves)
    assert set(curves) <= set(series(sample))
    assert isinstance(sample["timestamp"], float)


def test_it_is_nested_and_counted_as_the_program_does(root):
    """As its layouts: root > tabbed_widget > Tab > Container > DockSplitter > DockArea > plot > curve."""
    (window,) = root.findall("tabbed_widget")
    assert window.get("parent") == "main_window"
    tabs = window.findall("Tab")
    assert 0 <= int(window.find("currentTabIndex").get("index")) < len(tabs)
    for tab in tabs:
        assert tab.get("tab_name")
        containers = tab.findall("Container")
        assert len(containers) == int(tab.get("containers"))
        for container in containers:
            (splitter,) = container.findall("DockSplitter")
            areas = splitter.findall("DockArea")
            sizes = [float(size) for size in splitter.get("sizes").split(";")]
            assert splitter.get("orientation") in ("-", "|")
            assert int(splitter.get("count")) == len(areas) == len(sizes)
            assert sum(sizes) == pytest.approx(1.0, abs=1e-3)
            for area in areas:
                (plot,) = area.findall("plot")
                assert plot.get("mode") == "TimeSeries"
                assert plot.findall("curve")
    assert len(list(root.iter("curve"))) == len(
        window.findall("Tab/Container/DockSplitter/DockArea/plot/curve")
    )


def test_the_document_names_the_layout_and_the_steps_that_prevent_crashes():
    text = (LAYOUT.parent / "plotjuggler.md").read_text()
    assert LAYOUT.name in text
    assert "**msgpack**" in text
    assert "`timestamp`" in text
    assert "*address* `127.0.0.1`" in text, "the program puts tcp:// before it"
    assert "*port* `9872`" in text.replace("\n", " ").replace("   ", " ")
    assert all(f"\n{click}. " in text for click in range(1, 6))
