import math

import command_fuzzer
import pytest
from command_fuzzer import Bench, run

from rtctl.host.exchange import messages


def test_nothing_a_client_can_send_raises_or_gets_past_its_bounds():
    inputs, accepted = run(2026, 30_000)
    assert inputs == 30_000
    assert accepted > 1000, "inputs that are never accepted test nothing"


def test_the_fuzzer_finds_a_decoder_that_forgets_a_bound(monkeypatch):
    monkeypatch.setattr(messages, "_number", lambda value, _key, _where, _axis: float(value))
    with pytest.raises(AssertionError, match="input"):
        run(1, 30_000)


def test_the_fuzzer_finds_a_handler_that_acts_before_it_refuses(monkeypatch):
    bench = Bench(1)
    perform = bench.requests.perform

    def hasty(request, row, caller):
        bench.writer.command["compensation"] = math.pi / 10
        return perform(request, row, caller)

    monkeypatch.setattr(bench.requests, "perform", hasty)
    with pytest.raises(AssertionError, match="changed the command"):
        bench.run(5000)
    bench.memory.close()


def test_a_run_is_repeatable():
    assert command_fuzzer.run(7, 2000) == command_fuzzer.run(7, 2000)
