import force_fuzzer
import pytest

from hw.force import optoforce, rokubi


@pytest.mark.parametrize("kind", force_fuzzer.KINDS)
@pytest.mark.parametrize("count", [5000, pytest.param(200_000, marks=pytest.mark.volume)])
def test_no_bytes_raise_and_no_wrong_frame_passes(kind, count):
    inputs, accepted = force_fuzzer.run(kind, 2026, count)
    assert inputs == count
    assert accepted > count / 10, "inputs that are never accepted test nothing"


@pytest.mark.parametrize(("codec", "kind"), [(rokubi, "rokubi"), (optoforce, "optoforce 3-axis")])
def test_the_fuzzer_finds_a_checksum_that_is_not_looked_at(codec, kind, monkeypatch):
    monkeypatch.setattr(codec, "intact", lambda _frame: True)
    with pytest.raises(AssertionError, match="checksum is wrong"):
        force_fuzzer.run(kind, 1, 5000)


def test_the_fuzzer_finds_a_force_that_is_no_number(monkeypatch):
    decode = rokubi.decode
    monkeypatch.setattr(rokubi, "decode", lambda frame: decode(frame)._replace(status=0))
    with pytest.raises(AssertionError, match=r"nan|inf"):
        force_fuzzer.run("rokubi", 1, 5000)
