"""What one axis' compensation rests on: curve, inertia, bristles and feed-forward, read from the law's own
arrays.

A running host and a recording both have these arrays, hence both watch the friction by the same facts."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rtctl.control import compensation_limit as limits
from rtctl.control.records import LOAD_CELLS, MAX_SEGMENTS
from rtctl.control.vocabulary import PlaceUse
from rtctl.friction.drift_place import of_conservative, of_place
from rtctl.friction.guarantee import LENGTH_FACTOR
from rtctl.friction.load import IN_LAW, added_nm

SPEED_MIN_SHARE = 0.015
"""Slowest motion that counts, share of the trained range: below it the bristles' own motion is not small."""

_Curve = tuple[np.ndarray, np.ndarray]

_GRID = 400

# few points at the fastest speeds called nothing viscous, and all of it dry (decision 0069)
_UPPER = 0.5
"""Viscous friction is the slope of the curve above this share of the trained range, where the Stribeck part
has died out,"""

_DRY_LEAST = 0.5
"""as long as so much of the least friction is left dry."""


@dataclass(frozen=True)
class Deployed:
    """One axis. Torques in N m, speeds in rad/s, lengths in rad; index 0 of pairs is forward, 1 backward."""

    model: np.ndarray
    """Compiled friction model, shape (1,), dtype `MODEL`."""
    inertia_kgm2: float
    presliding_rad: float
    """Length after which bristles surely slide: presliding length with its doubt, without `LENGTH_FACTOR`."""
    doubt_nm: float
    """How far friction may be below the curve without a proof becoming false."""
    sliding_doubt_nm: float
    """How far sliding may be off the curve by the model's own points: that is no news."""
    place_doubt_nm: float
    """The same where the place is trusted: without what places differ by."""
    gain: float
    viscous_gain: float
    cap_nm: float
    place_shift_rad: float | None = None
    """Position where the model has its 0; None where it is used without places: friction is watched by speed
    alone."""

    pushes: bool = True
    """Whether the watch takes off the torque that a place alone exerts (cogging); False where its waves are
    too quick for the law to see, and no encoder knows them."""

    @property
    def identity(self) -> str:
        """Checksum of all that the watched factor is relative to: another model or inertia, another
        checksum."""
        # `repr`: the shortest text that is that very number
        facts = f"{self.inertia_kgm2!r} {self.presliding_rad!r}".encode()
        if self.place_shift_rad is not None:
            facts += f" {self.place_shift_rad!r}".encode()
        return hashlib.sha256(self.model.tobytes() + facts).hexdigest()

    @property
    def speed_max_rad_s(self) -> float:
        """Fastest speed that both directions were taught."""
        return float(self.model["speed_max_rad_s"][0].min())

    @property
    def speed_min_rad_s(self) -> float:
        """Slowest speed that is watched."""
        return SPEED_MIN_SHARE * self.speed_max_rad_s

    def doubt_of_sliding_nm(self, trust: float) -> float:
        """How far sliding may be off the model where what it says of place is trusted by this share, N m."""
        return self.sliding_doubt_nm + trust * (self.place_doubt_nm - self.sliding_doubt_nm)

    def dry_nm(
        self, velocity: np.ndarray, position: np.ndarray | None = None, trust: np.ndarray | float = 1.0
    ) -> np.ndarray:
        """Dry friction of the model at signed velocities, and at positions (rad) as far as they are trusted;
        a magnitude."""
        speed, forward = np.abs(velocity), velocity >= 0
        dry = np.empty_like(speed)
        for curve, there in zip(self._curves, (forward, ~forward), strict=True):
            if there.any():
                dry[there] = _at(curve, speed[there])
        if position is not None and self.place_shift_rad is not None:
            x = position - self.place_shift_rad
            here = np.where(forward, *(of_place(self.model[0], way, speed, x) for way in (0, 1)))
            dry = dry + trust * here
        return np.asarray(dry - self.viscous_nms_rad(velocity) * speed)

    @cached_property
    def _slopes(self) -> tuple[float, float]:
        """Viscous slope of each direction: as the model says, or as its curve has it where that is more.

        Model files of before `learn.fit.viscous_slope` went by the four fastest speeds say none where their
        points were few there. What is viscous in them would be called dry, which drift is told by."""
        forward, backward = (_viscous_slope(self.model, way, curve) for way, curve in enumerate(self._curves))
        return forward, backward

    @cached_property
    def _curves(self) -> tuple[_Curve, _Curve]:
        """Knots and coefficients of each direction."""
        row = self.model[0]
        # a recording is a file from elsewhere: no number in it may reach beyond the record
        forward, backward = (min(int(n), MAX_SEGMENTS) for n in row["n_segments"])
        return (
            (row["knot_rad_s"][0][: forward + 1], row["coefficient"][0][:forward]),
            (row["knot_rad_s"][1][: backward + 1], row["coefficient"][1][:backward]),
        )

    def pushed_nm(self, position: np.ndarray, trust: np.ndarray) -> np.ndarray:
        """Torque that the joint's place alone exerts on it at positions (rad), as far as they are trusted,
        N m."""
        if self.place_shift_rad is None or not self.pushes:
            return np.zeros_like(position)
        return np.asarray(trust * of_conservative(self.model[0], position - self.place_shift_rad))

    def unloaded_nm(self, velocity: np.ndarray, hand_nm: np.ndarray, motor_nm: np.ndarray) -> np.ndarray:
        """Hand's and motor's torque together, less what the load of both adds to the friction at these
        velocities, N m."""
        torque, row = hand_nm + motor_nm, self.model[0]
        if not row["load_most_nm"] > 0:
            return np.asarray(torque)
        cells = np.linspace(0.0, 1.0, LOAD_CELLS + 1) ** 4 * LOAD_CELLS**4 / row["load_cells_s_rad"]

        def fall(speed: np.ndarray) -> np.ndarray:
            return np.asarray(np.interp(speed, cells, row["load_fall"]))

        coefficients = {name: float(row[f"load_{name}"]) for name in IN_LAW}
        added = added_nm(coefficients, fall(np.abs(velocity)), hand_nm, motor_nm)
        return np.asarray(torque - np.sign(velocity) * added)

    def viscous_nms_rad(self, velocity: np.ndarray) -> np.ndarray:
        """Viscous slope of the friction in the direction of each velocity."""
        forward, backward = self._slopes
        return np.asarray(np.where(velocity >= 0, forward, backward))

    def least_factor(self, share: float = 1.0) -> float:
        """Factor of the dry friction below which `share` of the feed-forward exceeds the joint's friction at
        some speed."""
        found = 0.0
        for dry, viscous, most in self._taken_out:
            with np.errstate(divide="ignore", invalid="ignore"):  # `where` computes both of its sides
                # viscous friction is not scaled: it is the dry part that the factor is of
                # of either direction and any speed the largest: there the help exceeds friction first
                found = max(found, float(np.nanmax(np.where(dry > 0, (share * most - viscous) / dry, 0.0))))
        return found

    @cached_property
    def _taken_out(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Dry and viscous friction, and most of the feed-forward, over the speeds of each direction, N m."""
        found = []
        for direction in (1.0, -1.0):
            v = direction * np.linspace(self.speed_min_rad_s, self.speed_max_rad_s, _GRID)
            dry, viscous = self.dry_nm(v), self.viscous_nms_rad(v) * np.abs(v)
            of_law = float(self.model["viscous_nms_rad"][0, 0 if direction > 0 else 1]) * np.abs(v)
            most = limits.feedforward_limit(
                dry + viscous, of_law, self.gain, self.viscous_gain, 1.0, self.cap_nm
            )
            found.append((dry, viscous, most))
        return found


def deployed(params: np.ndarray, model: np.ndarray, axis: int) -> Deployed | None:
    """What axis `axis` runs with; None where there is no model, no force sensor, or no compensation.

    Parameters
    ----------
    params
        The law's parameters, shape (1,).
    model
        The compiled friction models, one for each axis."""
    # a copy: what is watched stays relative to the model that it began with
    p, one = params[0], model[axis : axis + 1].copy()
    if int(one["n_segments"][0].min()) < 1 or not p["force_used"] or not p["inertia_kgm2"][axis] > 0:
        return None
    least = float(one["friction_min_nm"][0].min())
    policy = int(p["friction_policy"][axis])
    gated = limits.is_force_gated(policy)
    doubt_nm = max(0.0, least - float(p["friction_floor_nm"][axis]))
    # 0 in recordings of before it was told apart
    sliding_nm = float(p["friction_sliding_doubt_nm"][axis]) or doubt_nm
    use = int(p["place_kind"][axis])
    return Deployed(
        model=one,
        inertia_kgm2=float(p["inertia_kgm2"][axis]),
        # the law has the length that is credited, longer by that factor to be on the safe side
        presliding_rad=float(p["presliding_rad"][axis]) / LENGTH_FACTOR,
        doubt_nm=doubt_nm,
        sliding_doubt_nm=sliding_nm,
        place_doubt_nm=float(p["friction_place_doubt_nm"][axis]) or sliding_nm,
        gain=float(p["friction_gain"][axis]),
        viscous_gain=float(p["friction_viscous_gain"][axis]),
        cap_nm=limits.cap_in_force(
            gated, float(p["friction_cap_nm"][axis]), float(p["friction_ungated_cap_nm"][axis])
        ),
        place_shift_rad=float(p["place_shift_rad"][axis]) if use != PlaceUse.OFF else None,
        pushes=use == PlaceUse.GIVEN or bool(p["conservative_judged"][axis]),
    )


def _viscous_slope(model: np.ndarray, branch: int, curve: _Curve) -> float:
    """Viscous slope of one direction, N m s/rad: the model's, or the median slope of its curve at the faster
    speeds where that is more."""
    told, top = float(model["viscous_nms_rad"][0, branch]), float(model["speed_max_rad_s"][0, branch])
    v = np.linspace(SPEED_MIN_SHARE * top, top, _GRID)
    friction = _at(curve, v)
    upper = v >= _UPPER * top
    # the median: a table's cells have slopes of their own, and a curve may end steeply
    slope = float(np.median(np.diff(friction[upper]) / np.diff(v[upper])))
    # a slope through all of the curve would leave nothing dry, and drift is told by what is
    most = float(((friction - _DRY_LEAST * friction.min()) / v).min())
    return max(told, min(slope, most))


def _at(curve: _Curve, speed: np.ndarray) -> np.ndarray:
    """A compiled curve at speeds >= 0, as `control.friction_curve.branch_magnitude` has it, for arrays."""
    knot, coefficient = curve
    u = np.minimum(np.maximum(speed, knot[0]), knot[-1])
    j = np.searchsorted(knot[1:-1], u, side="right")
    h, c = u - knot[j], coefficient[j]
    return np.asarray(c[:, 0] + h * (c[:, 1] + h * (c[:, 2] + h * c[:, 3])))
