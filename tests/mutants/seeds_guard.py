"""Bugs in what a daemon keeps a hand from: a zero taken under a pull, an arm beside a cause that stands."""

from seed import Seed

ZERO = "rtctl/host/exchange/force_zero.py"
UNIT = "tests/unit/host/test_force_zero.py"

SEEDS = (
    Seed(
        "the first tare after a start knows no zero before it", ZERO,
        "self._take_up(state_file.read(", "_ = (state_file.read(",
        (f"{UNIT}::test_a_hand_that_pulls_at_start_up_is_told_by_the_zero_of_before",),
    ),
    Seed(
        "a zero that was refused is kept for the next run", ZERO,
        "if said or not self.refusal():", "if True:",
        (f"{UNIT}::test_a_hand_that_pulls_at_start_up_is_told_by_the_zero_of_before",),
    ),
    Seed(
        "a word for one tare counts for another", ZERO,
        "said = 0 < self._by_word <= state[\"tare_seen\"]", "said = 0 < self._by_word",
        (f"{UNIT}::test_what_a_person_says_is_accepted_of_the_tare_it_was_said_for_and_of_no_other",),
    ),
    Seed(
        "a rig is armed before its zero was judged", "rtctl/host/exchange/requests.py",
        "        if self._zero.taring(int(self._slot.command[\"tare_count\"])):\n", "        if False:\n",
        (f"{UNIT}::test_nothing_is_armed_while_the_zero_is_not_known_nor_with_one_that_moved",),
    ),
    Seed(
        "a hand that has let go is still a hand", ZERO,
        "row[\"hand_torque_nm\"] + self.moved_nm()", "row[\"hand_torque_nm\"]",
        (f"{UNIT}::test_a_hand_that_has_let_go_is_seen_by_the_zero_of_before",),
    ),
)  # fmt: skip
