"""`rtctl bench deaths`: the rigs that it makes; nothing is measured here."""

from pathlib import Path

from rtctl.rig_file.config import load
from tests.bench import deaths

CONFIGS = Path(__file__).parents[2] / "configs"


def test_nobody_holds_the_joint_of_the_board_whose_loops_are_killed(tmp_path):
    """A hand on it in one life is a zero that the next may not take (decision 0129): none had torque."""
    board = load(deaths.board_alone(CONFIGS / "mock.toml", tmp_path))
    assert [hand["kind"] for hand in board.options["hand"]] == ["none"]
    assert (
        load(deaths.rig_file(CONFIGS / "serial.toml", tmp_path, "/dev/null")).options["port"] == "/dev/null"
    )
