import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rtctl.control.records import command_dtype
from rtctl.host.exchange.lease import LeaseDesk
from rtctl.host.exchange.messages import Refusal
from rtctl.host.exchange.veiled_leases import veil_leases


class Clock:
    s = 100.0

    def __call__(self):
        return self.s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def desk(clock):
    return LeaseDesk(1000.0, clock)


def claim(desk, who="key:a", epoch=1, *, held=False):
    return desk.claim(who, f"name of {who}", epoch, loop_holds=held)


def code(outcome):
    assert isinstance(outcome, Refusal), outcome
    return outcome.code


def test_numbers_are_random_of_62_bits_and_never_zero(clock):
    numbers = [claim(LeaseDesk(1000.0, clock)).number for _ in range(200)]
    assert len(set(numbers)) == 200
    assert all(0 < number < 2**62 for number in numbers)
    assert max(numbers) > 2**60


def test_a_second_commander_is_refused_and_told_by_whom_and_what_to_do(desk):
    claim(desk)
    refused = claim(desk, "key:b")
    assert refused.code == "lease_taken"
    assert "name of key:a" in refused.text
    assert "releases" in refused.text
    assert code(claim(desk)) == "lease_taken", "a second program of the same user is a second commander too"


def test_the_number_alone_is_of_no_use_to_another_user(desk):
    lease = claim(desk)
    assert code(desk.renew("key:b", lease.text, 1)) == "lease_lost"
    assert desk.renew("key:a", lease.text, 1) == lease


def test_silence_ends_it_and_renewing_prevents_that(desk, clock):
    lease = claim(desk)
    for _ in range(5):
        clock.s += 0.9
        assert desk.renew("key:a", lease.text, 1) == lease
    clock.s += 1.1
    refused = desk.renew("key:a", lease.text, 1)
    assert refused.code == "lease_lost"
    assert "silent" in refused.text
    assert claim(desk, "key:b").holder == "name of key:b"


def test_a_new_epoch_ends_it_for_good(desk):
    lease = claim(desk)
    assert code(desk.renew("key:a", lease.text, 2)) == "lease_lost"
    assert code(desk.renew("key:a", lease.text, 1)) == "lease_lost", "also if the epoch could come back"
    assert claim(desk, epoch=2).text != lease.text


def test_nobody_gets_it_while_the_loop_still_follows_the_last_holder(desk):
    lease = claim(desk)
    desk.end("released")
    assert code(desk.renew("key:a", lease.text, 1)) == "lease_lost"
    assert "again" in claim(desk, "key:b", held=True).text
    assert claim(desk, "key:b").user_id == "key:b"


def test_on_a_slow_rig_silence_takes_longer_than_the_loops_own():
    assert LeaseDesk(100.0).silence_s == 2.0


def test_published_commands_tell_leases_apart_and_nothing_else_of_them():
    commands = np.zeros(4, command_dtype(1))
    commands["target_lease"] = [0, 5, 5, 2**62 - 1]
    veiled = veil_leases(commands, "target_lease")
    none, first, again, other = veiled["target_lease"].tolist()
    assert none == 0
    assert first == again != other
    assert not {first, other} & {5, 2**62 - 1}
    assert commands["target_lease"].tolist() == [0, 5, 5, 2**62 - 1]


steps = st.lists(
    st.tuples(
        st.sampled_from(["claim", "renew", "end", "wait", "stop"]),
        st.sampled_from(["a", "b", "c"]),
        st.floats(0, 2),
    ),
    max_size=40,
)


@given(steps)
def test_there_is_never_more_than_one_holder_whatever_happens(script):
    clock = Clock()
    desk = LeaseDesk(1000.0, clock)
    epoch, texts = 1, {}
    for what, who, seconds in script:
        if what == "claim":
            made = claim(desk, who, epoch)
            if not isinstance(made, Refusal):
                texts[who] = made.text
        elif what == "renew" and who in texts:
            desk.renew(who, texts[who], epoch)
        elif what == "end":
            desk.end("test")
        elif what == "stop":
            epoch += 1
        clock.s += seconds if what == "wait" else 0.0
        holders = [w for w, text in texts.items() if not isinstance(desk.renew(w, text, epoch), Refusal)]
        assert len(holders) <= 1
        assert math.isfinite(clock.s)
