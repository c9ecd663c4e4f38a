"""An ODrive of another make that sends in bursts, leaves frames out and lies, judged from outside: by the
identifiers and layouts of its maker's page, not by rtctl's own codec.

A sample is fresh only where both of its frames, whole and of numbers, have come since the last one; it is the
newest; and a command that is no number leaves as no torque.
"""

import math
import random
import struct

import pytest

NODE = 1
ENCODER, CURRENT, TORQUE, HEARTBEAT = (NODE << 5 | command for command in (0x09, 0x14, 0x0E, 0x01))
CYCLES = 300


class Adversary:
    """Frames of each cycle, and which of them may count."""

    def __init__(self, seed):
        self.draw, self.turns = random.Random(seed), 0.0
        self.newest, self.have, self.fresh = 0.0, set(), 0

    def _good(self, can_id):
        self.turns += 1 / 4096
        value = self.turns if can_id == ENCODER else 0.25
        self.have.add(can_id)
        if can_id == ENCODER:
            self.newest = value
        return can_id, struct.pack("<ff", *((value, 0.0) if can_id == ENCODER else (0.0, value)))

    def next(self):
        """Frames of this cycle; `fresh` counts the samples they are good for."""
        draw, frames = self.draw, []
        for _ in range(draw.choice((0, 1, 1, 1, 1, 2, 3, 20))):
            both = [ENCODER, CURRENT]
            draw.shuffle(both)
            for can_id in both:
                kind = draw.choice(("good",) * 8 + ("gap", "short", "long", "nan", "foreign"))
                bad = {
                    "short": (can_id, struct.pack("<f", 9.0)),
                    "long": (can_id, b""),
                    "nan": (can_id, struct.pack("<ff", math.nan, math.inf)),
                    "foreign": (can_id + 32, struct.pack("<ff", 7.0, 7.0)),
                }
                frames += [self._good(can_id)] if kind == "good" else [bad[kind]] if kind in bad else []
        if len(self.have) == 2:
            self.have.clear()
            self.fresh += 1
            return frames, True
        return frames, False


@pytest.mark.parametrize("compiled_half", [True, False], ids=["compiled", "Python"])
def test_only_whole_pairs_are_fresh_and_a_command_that_is_no_number_is_no_torque(pair, compiled_half):
    device = pair("can-odrive.toml", "odrive", compiled_half=compiled_half)
    told = device.sim.pass_time
    device.sim.pass_time = lambda *now: [frame for frame in told(*now) if frame[0] == HEARTBEAT]
    device.cycle()
    before, board, shown = int(device.tick["sample_count"][0]), Adversary(26), []
    draw = random.Random(7)
    for k in range(CYCLES):
        frames, fresh = board.next()
        command = draw.choice((math.nan, math.inf, -math.inf)) if k % 7 == 0 else draw.uniform(-1.0, 1.0)
        seen, sent = device.cycle(enabled=int(k > 20), current_a=command, more=frames)
        assert int(seen["sample_count"][0]) - before == board.fresh, f"cycle {k}"
        if fresh:
            shown.append((board.newest, float(seen["position_rad"][0, 0])))
        torques = [struct.unpack("<f", bytes(data)[:4])[0] for can_id, data in sent if can_id == TORQUE]
        assert len(torques) == 1
        assert math.isfinite(torques[0])
        assert torques[0] == 0.0 or (math.isfinite(command) and k > 20), f"cycle {k}"
    assert 0.3 * CYCLES < len(shown) < 0.9 * CYCLES
    (a, x), (b, y) = shown[0], shown[-1]
    for turns, rad in shown:
        assert rad == pytest.approx(x + (y - x) * (turns - a) / (b - a), abs=1e-5), "the newest, as sent"
    assert not compiled_half or device.left["write"] < CYCLES / 2
