"""Rights that the kernel refuses half-way are told as refused."""

from pathlib import Path

from rtctl.rt import realtime


def test_a_wake_up_latency_that_is_not_taken_is_not_granted(monkeypatch):
    monkeypatch.setattr(realtime, "_DMA_LATENCY", Path("/dev/full"))
    grant = realtime._dma_latency([])
    assert not grant.granted
    assert "No space left" in grant.detail
    monkeypatch.setattr(realtime, "_DMA_LATENCY", Path("/dev/null"))
    assert realtime._dma_latency([]).granted
