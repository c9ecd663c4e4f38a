"""Constants in frames that are sent: what the bits of their field can hold, and nothing else."""

import pytest
from test_can_select import POSITION, WANTED

from hw.can.board_options import BoardOptions


def board(told):
    constant = {"channel": "constant", "byte": 2, "bits": 8, **told}
    given = {"receive": [{"id": 1, "field": [POSITION]}], "send": [{"id": 2, "field": [WANTED, constant]}]}
    return BoardOptions.model_validate({"bus": {"channel": "can0"}, **given})


@pytest.mark.parametrize("told", [{"value": 255}, {"value": 3.4}, {"type": "int", "value": -128}])
def test_one_is_sent_as_near_as_its_bits_come(told):
    board(told)


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({"value": 300}, 255),
        ({"value": -1}, 0),
        ({"type": "int", "value": 128}, 127),
        ({"scale": 0.1, "offset": -10, "value": -11}, -10),
    ],
)
def test_one_that_its_bits_cannot_hold_is_refused(told, said):
    with pytest.raises(ValueError, match=f"cannot say {told['value']}, only {said}"):
        board(told)
