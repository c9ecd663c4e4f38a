"""Requests that describe the world near the joint: intermediate representations, rendered by the loop at its
rate."""

from __future__ import annotations

from typing import Any, Literal

from rtctl.client.lease import Lease
from rtctl.control.vocabulary import PARAMETERS, KindName

NUMBERS = tuple(one.name for one in PARAMETERS)


class Worlds:
    """What a program sets of the virtual environment of one axis. None of these jumps: the law lets them
    follow.

    Angles are of the joint, rad. A client with the role renderer gives its `lease`. All return what is then
    commanded, and raise RefusedError for a value out of bounds (see `hello`)."""

    def set_environment(
        self, axis: str | int, kind: KindName, *, lease: Lease | None = None, **numbers: float | None
    ) -> dict[str, Any]:
        """Set the virtual environment of one axis; numbers left out, or None, stay. Returns what is then
        commanded.

        A client with the role renderer gives its `lease`. Kinds, numbers and their units are those of the
        request `environment` (docs/protocol.md). Raises RefusedError for a value out of bounds (see `hello`),
        and TypeError for a number that no environment has."""
        # before anything is sent: the daemon would tell of a key, and not of a parameter
        if unknown := [name for name in numbers if name not in NUMBERS]:
            raise TypeError(f"set_environment: no number {unknown[0]!r}; there are {', '.join(NUMBERS)}")
        # a number that is left out keeps its value in the daemon
        values: dict[str, Any] = {name: value for name, value in numbers.items() if value is not None}
        if lease is not None:
            values["lease"] = lease.text
        return self._result("environment", axis=axis, kind=kind, **values)

    def set_display(
        self,
        axis: str | int,
        display: Literal["impedance", "admittance"] | None = None,
        *,
        lease: Lease | None = None,
        mass_kgm2: float | None = None,
        mass_damping_nms_rad: float | None = None,
    ) -> dict[str, Any]:
        """Change what an axis shows while it runs; what is left out keeps its value.

        Parameters
        ----------
        lease
            Of a client with the role renderer.
        display
            The other display, where the rig file has `display_change = true`; it fades out and in over half a
            second.
        mass_kgm2, mass_damping_nms_rad
            Virtual mass and damping of an admittance, from the rig file's own up to its `mass_max_kgm2` and
            `damping_max_nms_rad`; taken within a tenth of a second, a heavier mass as far as its energy is
            paid.

        Returns
        -------
        dict
            What is commanded of the axis now. What is in force is in the ticks.

        Raises
        ------
        RefusedError
            `out_of_bounds` where the rig file does not allow it."""
        values: dict[str, Any] = {"axis": axis}  # what is left out keeps its value in the daemon
        if display is not None:
            values["display"] = display
        for name, value in (("mass_kgm2", mass_kgm2), ("mass_damping_nms_rad", mass_damping_nms_rad)):
            if value is not None:
                # a plain number: NumPy's have no place in msgpack
                values[name] = float(value)
        if lease is not None:
            values["lease"] = lease.text
        return self._result("display", **values)

    def set_plane(
        self,
        axis: str | int,
        *,
        face_rad: float,
        stiffness_nm_rad: float,
        damping_nms_rad: float = 0.0,
        side: Literal[-1, 1] = 1,
        lease: Lease | None = None,
    ) -> dict[str, Any]:
        """A plane near the joint: a wall with its face at `face_rad`, complete, nothing kept of the world
        before.

        `side` 1 resists motion to larger angles, -1 to smaller ones."""
        return self.set_environment(
            axis,
            "wall",
            center_rad=face_rad,  # a wall begins at its place
            stiffness_nm_rad=stiffness_nm_rad,
            damping_nms_rad=damping_nms_rad,  # told in any case: else the world before would be in it
            side=side,
            lease=lease,
        )

    def set_spring(
        self, axis: str | int, *, rest_rad: float, stiffness_nm_rad: float, lease: Lease | None = None
    ) -> dict[str, Any]:
        """A spring that pulls to `rest_rad` from both sides, complete, nothing kept of the world before."""
        return self.set_environment(
            axis, "spring", center_rad=rest_rad, stiffness_nm_rad=stiffness_nm_rad, lease=lease
        )

    def _result(self, op: str, **values: object) -> dict[str, Any]:
        raise NotImplementedError
