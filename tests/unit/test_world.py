"""The ball of the virtual world."""

import math
from itertools import pairwise

import pytest
from patience import until

from rtctl.client.view_world import FRAME_S, Ball, World
from rtctl.errors import RefusedError


def test_a_ball_left_alone_stays():
    ball = Ball(0.1)
    for _ in range(100):
        ball.step(0.05, FRAME_S)
    assert ball == Ball(0.1)


def test_a_ball_that_is_pushed_rolls_away_and_comes_to_rest():
    ball = Ball(0.0)
    for _ in range(5):
        ball.step(0.1, FRAME_S)
    assert ball.face_rad > 0.0
    assert ball.speed_rad_s > 0.0
    for _ in range(300):
        ball.step(-1.0, FRAME_S)
    assert ball.speed_rad_s == pytest.approx(0.0, abs=1e-6)


def test_a_ball_under_a_handle_that_stays_leaves_it_without_ever_coming_back():
    ball, faces = Ball(0.0), []
    for _ in range(600):
        ball.step(0.2, FRAME_S)
        faces.append(ball.face_rad)
    assert ball.speed_rad_s == pytest.approx(0.0, abs=1e-6)
    assert faces[-1] >= 0.2
    assert all(b >= a for a, b in pairwise(faces))


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_ball_outlives_a_bad_sample(bad):
    ball = Ball(0.1)
    ball.step(bad, FRAME_S)
    assert ball == Ball(0.1)


def test_a_drag_after_a_ball_begins_where_the_proxy_is_then():
    class Held:
        def __init__(self, at):
            self.lost, self.start_rad, self.sent = "", (at,), []

        def set_target(self, position_rad):
            self.sent.append(position_rad[0])

        def release(self):
            self.lost = "released"

    class Client:
        at, leases = 0.3, ()

        def status(self):
            return {}

        def lease(self):
            self.leases = (*self.leases, Held(self.at))
            return self.leases[-1]

        def set_environment(self, _axis, kind, **values):
            return {"environment": {"kind": kind, **values}}

        def latest_state(self):
            return self

        position_rad = (0.0,)

    client = Client()
    world = World(client, {"axes": [{"name": "joint"}]})
    try:
        world.choose("drag", center_rad=0.3)
        client.at = -0.4
        world.choose("ball", center_rad=0.0)
        assert client.leases[0].lost == "released"
        world.choose("drag", center_rad=-0.4)
        assert client.leases[-1].sent[0] == -0.4
    finally:
        world.close()


def test_the_page_is_told_where_the_law_has_the_world():
    class Client:
        def set_environment(self, axis, kind, **values):
            return {"axis": axis, "environment": {"kind": kind, **values, "side": 1}}

    world = World(Client(), {"axes": [{"name": "joint"}]})
    try:
        world.choose("wall", center_rad=0.3, pitch_rad=0.1)
        told = world.describe()
        assert (told["kind"], told["center_rad"], told["side"], told["pitch_rad"]) == ("wall", 0.3, 1, 0.1)
        assert until(lambda: world.frame_hz, "two frames") > 0
    finally:
        world.close()


def test_a_ball_that_the_daemon_refused_is_not_put_into_the_hand():
    class Client:
        asked = 0

        def set_environment(self, *_asked, **_values):
            self.asked += 1
            raise RefusedError("out_of_bounds", "damping_nms_rad")

        def latest_state(self):
            raise AssertionError("there is no ball that could meet the joint")

    client = Client()
    world = World(client, {"axes": [{"name": "joint"}]})
    try:
        with pytest.raises(RefusedError):
            world.choose("ball", damping_nms_rad=1e9)
        assert world._ball is None
        seen = len(world._frames)
        assert until(lambda: len(world._frames) > seen + 1)
        assert (client.asked, world.kind) == (1, "")
    finally:
        world.close()
