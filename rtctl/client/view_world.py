"""A virtual world to start from: what a 60 Hz program outside the daemon does with the public client.

The kinds of the law's table of environments are the law's: this program only sets their
numbers, and the loop renders them at its own rate (an intermediate representation). The ball is a wall whose
face this program moves 60 times a second, by the ball's own equation of motion; `drag` moves the proxy of a
remote environment under a lease, as a program with bodies of its own would."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hw.motion import unit
from rtctl.client import Lease, RigClient
from rtctl.control.vocabulary import CENTER, PARAMETERS, STIFFNESS, Environment, Parameter
from rtctl.errors import ClientError, RefusedError

FRAME_S = 1 / 60
# two seconds of 60 a second have 121 ends
FRAMES_COUNTED = 121
LOST_S = 0.1
"""Frames are made up for after a delay shorter than this; after a longer one the world stood still."""
LAW = {kind.word: kind.about for kind in Environment if not kind.about.active}
"""Worlds that are environments of the law."""

OURS = {
    "ball": "A ball to push: it rolls away, and comes to rest.",
    "drag": "A proxy that follows the slider and pulls the joint along.",
}
"""Worlds that this program moves, by one slider: their place."""

KINDS = (*LAW, *OURS)
SLIDERS = {one.name: one.slider for one in PARAMETERS if one.slider}

BALL_KG_M2 = 0.02
"""Inertia of the ball as the joint feels it, kg m^2."""

BALL_DRAG_NMS_RAD = 0.15
BALL_STIFFNESS_NM_RAD = 15.0
DRAG_RATE_RAD_S = 1.0
"""The dragged proxy goes no faster than this, whatever the mouse does."""

TARGET_TICKS = 8
"""While something is dragged a frame is no longer than this many ticks: after 20 (and 20 ms) without a target
the rig holds still."""

SHORTEST_FRAME_S = 1e-3


COUPLING_NM_RAD = 60.0
"""Stiffness of the coupling that the numbers here are chosen for; of a linear axis they are in proportion to
its own."""

TRAVEL_MOST_M = 100.0
"""A longer travel is one that the rig file does not tell."""


@dataclass(frozen=True)
class Scale:
    """What stands for a radian (`length`), and for 1 N m/rad and 1 N m s/rad (`stiffness`), on an axis; of a
    rotary one 1."""

    length: float = 1.0
    stiffness: float = 1.0
    motion: str = "rotary"

    @classmethod
    def of(cls, axis: Mapping[str, Any]) -> Scale:
        """Make the scale of an axis as the daemon's `hello` describes it: of a linear one by half its travel,
        and its coupling."""
        if axis.get("motion") != "linear":
            return cls()
        low, high = axis["bounds"]["position_rad"]
        # a metre, where the rig file has left the ends out
        # half of it below: a slider goes to both sides of its middle
        travel = high - low if high - low < TRAVEL_MOST_M else 1.0
        stiffness = (axis["coupling"] or {}).get("stiffness_nm_rad") or COUPLING_NM_RAD
        return cls(0.5 * travel, stiffness / COUPLING_NM_RAD, "linear")

    def factor(self, unit_of: str) -> float:
        """Factor on a number of this unit, of those that sliders have."""
        return self.length if unit_of == "rad" else self.stiffness

    def slider(self, parameter: Parameter) -> dict[str, Any]:
        """A parameter's slider on this axis, with its unit."""
        assert parameter.slider is not None
        factor, own = self.factor(parameter.unit), asdict(parameter.slider)
        own |= {name: factor * own[name] for name in ("low", "high", "value")}
        return {**own, "unit": unit(parameter.unit, self.motion)}


@dataclass
class Ball:
    """A ball on the joint's path, pushed to larger positions: its near face and speed.

    Stiffness, inertia and drag of a linear axis's ball have one factor (`Scale.stiffness`), so that its
    motion does not know it."""

    face_rad: float
    speed_rad_s: float = 0.0

    def step(self, handle_rad: float, dt_s: float) -> None:
        """Advance by one frame: the handle's push, rolling drag."""
        deep_rad = handle_rad - self.face_rad
        # false for a NaN, which a bad sample shows: in face and speed it would stay for ever
        push = BALL_STIFFNESS_NM_RAD * deep_rad if 0.0 < deep_rad < math.inf else 0.0
        # exact, since 60 frames a second are few for a drag that takes .13 s
        decay = math.exp(-BALL_DRAG_NMS_RAD / BALL_KG_M2 * dt_s)
        self.speed_rad_s = self.speed_rad_s * decay + push / BALL_KG_M2 * dt_s
        # with the speed of after the push: so a stiff contact does not gain energy (sqrt(k/J) dt = .46 < 2)
        self.face_rad += self.speed_rad_s * dt_s


def offered(hello: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What the page offers on the first axis, a rotary one unless `hello` says otherwise: each world with its
    meaning and the numbers it has sliders for; and the sliders."""
    scale = Scale.of(hello["axes"][0]) if hello else Scale()
    places = "positions" if scale.motion == "linear" else "angles"
    worlds = {name: (about.meaning, about.parameters) for name, about in LAW.items()}
    worlds |= {name: (meaning, {CENTER: ""}) for name, meaning in OURS.items()}
    return {
        "worlds": {
            name: {
                "meaning": meaning.replace("angles", places),
                "numbers": [one.name for one in parameters if one.slider],
                "law": name in LAW,
            }
            for name, (meaning, parameters) in worlds.items()
        },
        "sliders": {one.name: scale.slider(one) for one in PARAMETERS if one.slider},
    }


class World:
    """The present world on axis 0, and the thread that animates it.

    Parameters
    ----------
    client
        Requests of the page and of this thread take turns on it.
    hello
        The daemon's `hello`: names and bounds of the axes."""

    def __init__(self, client: RigClient, hello: Mapping[str, Any]) -> None:
        self._client = client
        # the first axis: a world of a joint is one-dimensional, and the page has one slider
        self._axis = hello["axes"][0]["name"]
        self._scale = Scale.of(hello["axes"][0])
        self._lock = threading.Lock()
        self._closed = threading.Event()
        self._ball: Ball | None = None
        self._drag_rad: float | None = None
        self._lease: Lease | None = None
        self._proxy_rad: list[float] = []  # of all axes: a target has one number for each
        self._drag_frame_s = min(FRAME_S, max(TARGET_TICKS / hello.get("rate_hz", 1e3), SHORTEST_FRAME_S))
        self._in_force: dict[str, Any] = {}
        self.kind = ""
        self.trouble = ""
        self._frames: deque[float] = deque(maxlen=FRAMES_COUNTED)
        self._thread = threading.Thread(target=self._animate, name="rtctl-world", daemon=True)
        self._thread.start()

    def choose(self, kind: str, **numbers: float) -> dict[str, Any]:
        """Enter a world; numbers left out are where their sliders begin.

        Raises ValueError for a world or a number there is not, ClientError for what the daemon refuses."""
        if kind not in KINDS or not numbers.keys() <= SLIDERS.keys():
            raise ValueError(
                f"kind {kind!r} with {', '.join(numbers) or 'no numbers'}: there are {', '.join(KINDS)}, "
                f"with {', '.join(SLIDERS)}"
            )
        values: dict[str, Any] = {
            one.name: numbers.get(one.name, self._scale.slider(one)["value"])
            for one in PARAMETERS
            if one.slider
        }
        if not all(math.isfinite(float(x)) for x in values.values()):
            raise ValueError("every number must be finite")
        with self._lock:
            # before anything can fail: the last world must not go on moving beside the next
            self._ball, self._drag_rad, self.trouble = None, None, ""
            if kind == "ball":
                values[STIFFNESS.name] = BALL_STIFFNESS_NM_RAD * self._scale.stiffness
            elif kind == "drag":
                self._take_lease()  # before the environment, which waits for targets from then on
            law_kind = {"ball": "wall", "drag": "remote"}.get(kind, kind)
            in_force = self._client.set_environment(self._axis, law_kind, **values)
            self.kind, self._in_force = kind, in_force["environment"]
            # not before the daemon took it: a ball of a refused world would put a wall, of whatever stiffness
            # there was, into the hand 60 times a second
            if kind == "ball":
                self._ball = Ball(values[CENTER.name])
            elif kind == "drag":
                self._drag_rad = values[CENTER.name]
                self._frame()
            if kind != "drag" and self._lease is not None:
                # no other world needs it: another renderer may have it, and the next drag begins at the joint
                self._lease.release()
        return in_force

    def describe(self) -> dict[str, Any]:
        """For the page."""
        ball = self._ball  # once: the thread may put another in its place meanwhile
        return {
            "kind": self.kind,
            "axis": self._axis,
            "ball_rad": None if ball is None else ball.face_rad,
            **{one.name: self._in_force.get(one.name) for one in PARAMETERS},
            "trouble": self.trouble,
            "frame_hz": self.frame_hz,
        }

    @property
    def frame_hz(self) -> float | None:
        """Frames per second over the last two; None until there are two frames."""
        frames = list(self._frames)
        return (len(frames) - 1) / (frames[-1] - frames[0]) if len(frames) > 1 else None

    def release(self) -> None:
        """After a stop: whatever moves here lets go, and leaves nothing behind that waits for targets."""
        with self._lock:
            if self._drag_rad is not None:
                self._let_go()

    def close(self) -> None:
        """End the animation."""
        self._closed.set()
        # a request may be waiting for its reply for so long
        self._thread.join(2.0)

    def _take_lease(self) -> None:
        """Hold the lease of the present epoch, and begin where the proxy is."""
        if self._lease is None or self._lease.lost:
            self._client.status()  # a lease belongs to the epoch last seen
            self._lease = self._client.lease()  # lost ones are not taken again by themselves
            self._proxy_rad = list(self._lease.start_rad)

    def _let_go(self) -> None:
        """End the drag. Nobody but the next renderer should find the rig waiting for targets."""
        # first: a request that fails below must not leave it dragging
        self._drag_rad, self.kind = None, ""
        # else another renderer has taken over, and its world stays
        if self._client.status()["lease_holder"] is None:
            self._client.set_environment(self._axis, "free")

    def _animate(self) -> None:
        due = time.monotonic()
        while not self._closed.wait(max(0.0, due - time.monotonic())):
            frame_s = self._frame_s
            due += frame_s
            # a page that was halted must not render a second's worth of frames at once
            if time.monotonic() - due > LOST_S:
                due = time.monotonic()
            with self._lock:
                try:
                    self._frame()
                # told on the page, and tried again with the next picture: what is refused now may be granted
                # then
                except RefusedError as error:
                    self.trouble = error.reason
                except ClientError as error:
                    self.trouble = str(error)
            self._frames.append(time.monotonic())

    @property
    def _frame_s(self) -> float:
        return FRAME_S if self._drag_rad is None else self._drag_frame_s  # asked anew for each

    def _frame(self) -> None:
        """One picture's worth of world."""
        if self._ball is not None:
            handle_rad = self._client.latest_state().position_rad[0]
            self._ball.step(handle_rad, FRAME_S)
            self._client.set_environment(self._axis, "wall", center_rad=self._ball.face_rad, side=1)
        elif self._drag_rad is not None:
            self._drag(self._drag_rad)
        else:
            return
        self.trouble = ""

    def _drag(self, wanted_rad: float) -> None:
        """Move the proxy a step nearer to where the mouse is; after a stop somebody has to decide to go
        on."""
        assert self._lease is not None
        if why := self._lease.lost:
            self._let_go()
            raise ClientError(f"no longer dragged: {why}; choose drag again")
        step = DRAG_RATE_RAD_S * self._scale.length * self._drag_frame_s
        self._proxy_rad[0] += min(max(wanted_rad - self._proxy_rad[0], -step), step)
        self._lease.set_target(self._proxy_rad)
