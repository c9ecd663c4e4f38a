"""Who moves the rig, and how: the lease, targets, virtual environments, displays, compensation."""

from __future__ import annotations

from typing import Any

import numpy as np

from rtctl.control.vocabulary import PARAMETERS, Display, Environment
from rtctl.host.exchange.lease import LeaseDesk
from rtctl.host.exchange.messages import Refusal, Request
from rtctl.host.exchange.newest_command import CommandSlot
from rtctl.host.exchange.rig_description import RigDescription
from rtctl.wire.authenticator import Caller

Result = dict[str, Any]


class Steering:
    """Handlers of the operations that give the rig something to follow.

    Parameters
    ----------
    slot
        The newest command.
    rig
        Names, axes and bounds.
    desk
        The lease."""

    def __init__(self, slot: CommandSlot, rig: RigDescription, desk: LeaseDesk) -> None:
        self._slot = slot
        self._rig = rig
        self._desk = desk

    def lease(self, request: Request, row: np.void, caller: Caller) -> Result | Refusal:
        """Give or renew the lease."""
        epoch = int(row["epoch"])
        # a renewal: to claim anew would be refused, as it is taken
        if "lease" in request.values:
            lease = self._desk.renew(caller.user_id, request.values["lease"], epoch)
        else:
            lease = self._desk.claim(caller.user_id, caller.name, epoch, loop_holds=bool(row["lease_held"]))
        if isinstance(lease, Refusal):
            return lease
        return {
            "lease": lease.text,
            "silence_s": self._desk.silence_s,
            "target_position_rad": self._proxy(row),
            # none: a renderer whose environments went with a restart is told before it sends into nothing
            "remote": [self._rig.axes[axis].name for axis in np.flatnonzero(self._is_remote())],
        }

    def release(self, request: Request, row: np.void, caller: Caller) -> Result | Refusal:
        """Take the lease back from its holder."""
        # who may renew it is its holder
        lease = self._desk.renew(caller.user_id, request.values["lease"], int(row["epoch"]))
        if isinstance(lease, Refusal):
            return lease
        self._desk.end("its holder released it")
        return {"command_seq": self._slot.release()}

    def environment(self, request: Request, row: np.void, caller: Caller) -> Result | Refusal:
        """Set the virtual environment of an axis; a renderer needs the lease."""
        if why := self._not_holder(request, row, caller):
            return why
        axis, command = request.values["axis"], self._slot.command
        command["environment_kind"][axis] = Environment[request.values["kind"].upper()]
        for one in PARAMETERS:
            if one.name in request.values:
                command[f"environment_{one.name}"][axis] = request.values[one.name]
        return {"command_seq": self._slot.send(), **self.axis_in_force(axis)}

    def display(self, request: Request, row: np.void, caller: Caller) -> Result | Refusal:
        """Set what an axis shows; a renderer needs the lease."""
        if why := self._not_holder(request, row, caller):
            return why
        axis, command = request.values["axis"], self._slot.command
        about, shown = self._rig.axes[axis], request.values.get("display")
        if shown is not None and shown not in about.displays:
            return Refusal(
                "out_of_bounds",
                f"display: axis {about.name} shows an {' or an '.join(about.displays)}; for another it "
                "needs display_change = true in the rig file",
            )
        if shown is not None:
            command["display_kind"][axis] = Display[shown.upper()]
        for name in ("mass_kgm2", "mass_damping_nms_rad"):
            if name in request.values:
                command[name][axis] = request.values[name]
        return {"command_seq": self._slot.send(), **self.axis_in_force(axis)}

    def target(self, request: Request, row: np.void, caller: Caller) -> Result | Refusal:
        """Move the proxy of the remote axes; only the holder of the lease."""
        # told, rather than followed by nothing: a renderer would not know why nothing moves
        if not self._is_remote().any():
            return Refusal("not_remote", "no axis has the environment `remote`; set it first")
        epoch = int(row["epoch"])
        lease = self._desk.renew(caller.user_id, request.values["lease"], epoch)
        if isinstance(lease, Refusal):
            return lease
        # 0: a renderer that tells no velocity holds its proxy still between two targets
        position, velocity = request.values["position_rad"], request.values.get("velocity_rad_s", 0.0)
        return {"command_seq": self._slot.target(epoch, lease.number, position, velocity)}

    def _is_remote(self) -> np.ndarray:
        """Which axes have the environment `remote` commanded, shape (axes,)."""
        of_axes: np.ndarray = self._slot.command["environment_kind"] == Environment.REMOTE
        return of_axes.ravel()

    def compensation(self, request: Request, _row: np.void, _caller: Caller) -> Result:
        """Set the share of the friction feed-forward."""
        axis = request.values.get("axis", slice(None))
        self._slot.command["compensation"][axis] = request.values["share"]
        return {"command_seq": self._slot.send()}

    def axis_in_force(self, a: int) -> Result:
        """What is commanded for axis `a` now."""
        command = self._slot.command
        return {
            "axis": self._rig.axes[a].name,
            "environment": {
                "kind": Environment(int(command["environment_kind"][a])).word,
                **{one.name: command[f"environment_{one.name}"][a].item() for one in PARAMETERS},
            },
            "display": {
                "kind": Display(int(command["display_kind"][a])).name.lower(),
                "mass_kgm2": float(command["mass_kgm2"][a]),
                "mass_damping_nms_rad": float(command["mass_damping_nms_rad"][a]),
            },
            "compensation": float(command["compensation"][a]),
            "friction_factor": 1.0 + float(command["friction_change"][a]),
            "target_position_rad": float(command["target_position_rad"][a]),
            "target_velocity_rad_s": float(command["target_velocity_rad_s"][a]),
        }

    def _proxy(self, row: np.void) -> list[float]:
        """Where the proxy is, for a renderer that begins or comes back: start there, and nothing jumps."""
        positions: list[float] = row["proxy_position_rad"].tolist()
        return positions

    def _not_holder(self, request: Request, row: np.void, caller: Caller) -> Refusal | None:
        if caller.role == "operator" and "lease" not in request.values:
            return None
        if "lease" not in request.values:
            return Refusal("missing_key", "lease: a renderer changes an environment with the lease only")
        lease = self._desk.renew(caller.user_id, request.values["lease"], int(row["epoch"]))
        return lease if isinstance(lease, Refusal) else None
