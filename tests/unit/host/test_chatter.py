"""A device that flickers does not fill the event log, and what was left out is counted."""

from rtctl.cli.events import line
from rtctl.host.repeated_events import BURST, ChatterFilter


def device(tick, axis="tip"):
    said = {
        "device": "device[0] 'can'",
        "axis": axis,
        "text": str(tick),
        "faults": ["DEVICE"],
        "silent": False,
    }
    return {"event": "device", "tick": tick, "timestamp": 0.0, "monotonic_s": tick * 1e-3, **said}


def test_a_device_that_flickers_is_counted_by_axis():
    keep = ChatterFilter()
    kept = [event for tick in range(1000) for event in keep([device(tick)])]
    assert len(kept) == BURST
    assert keep([device(1000, "base")])
    (later,) = keep([device(30_000)])
    assert later["suppressed"] == 1000 - BURST
    assert line(later).endswith("device[0] 'can', axis tip: 30000; DEVICE (980 like it before, not listed)")
    keep([device(30_000) for _ in range(100)])
    (left,) = keep.flush()
    assert (left["name"], left["suppressed"] > 0) == ("of device[0] 'can', axis tip", True)
