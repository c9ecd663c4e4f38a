"""The simulated drive on a machine whose kernel has no CAN, as most containers."""

from types import SimpleNamespace

import pytest

from hw.simulators import can_device


def test_it_says_where_it_can_be_played(monkeypatch, capsys):
    def refused(**_):
        raise OSError(97, "Address family not supported by protocol")

    monkeypatch.setattr(can_device, "python_can", lambda: SimpleNamespace(Bus=refused))
    with pytest.raises(SystemExit) as ended:
        can_device.main(["odrive", "--channel", "vcan0"])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert "socketcan vcan0: Address family not supported" in told
    assert "--interface udp_multicast --channel 239.74.163.2" in told
