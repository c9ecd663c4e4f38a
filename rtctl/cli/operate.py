"""`rtctl status | arm | stop | reset | tare | adapt`: a running rig by the command line, as an operator's
client."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hw.motion import of_axes, words
from rtctl.cli.json_text import json_text
from rtctl.cli.number import Number
from rtctl.cli.rig_argument import connect, reach_options

if TYPE_CHECKING:
    from rtctl.client import RigClient

SWITCH = ("on", "off")
# the ramp takes 50 ms at most (`law_plan.STOP_S`); the rest is for a host that is busy
STOP_S = 2.0
# a fifth of the ramp of 50 ms: told soon after it is so
POLL_S = 0.01

_Act = Callable[..., None]


def _operation(name: str) -> Callable[[_Act], click.Command]:
    """A command that does `act` to a rig, then tells its state."""

    def made(act: _Act) -> click.Command:
        # click takes the help, and options beyond these, from `act`
        @wraps(act)
        def run(
            rig: str | None,
            runtime_dir: Path | None,
            address: str | None,
            key: Path | None,
            *,
            as_json: bool,
            **more: object,
        ) -> None:
            with connect(rig, runtime_dir, address, key) as client:
                act(client, **more)
                # asked after the act: what a person reads is how it is now
                hello = client.hello()
                # get: a daemon of before does not tell what is not proved
                of_rig = {"rig": hello["rig"], "not_proved": hello.get("not_proved", [])}
                told = {**of_rig, **client.status()}
            click.echo(json_text(told) if as_json else "\n".join(lines(told)))

        flag = click.option("--json", "as_json", is_flag=True, help="the state as one JSON object")
        return click.command(name)(reach_options(flag(run)))

    return made


@_operation("status")
def status(_client: RigClient) -> None:
    """Show the state of a running rig: state, faults with their remedy, axes, who holds the lease."""


@click.option(
    "--timeout", "timeout_s", type=Number(0.1, 600), default=10.0, help="seconds until the rig must be ACTIVE"
)
def _arm(client: RigClient, timeout_s: float) -> None:
    """Arm a running rig: from here on its motor may move. Ends when the rig is ACTIVE.

    Whoever calls this is the operator, and sees the rig. Its test pulse needs a joint that rests; hands off
    for a second."""
    client.arm(timeout_s=timeout_s)


arm = _operation("arm")(_arm)


@_operation("stop")
def stop(client: RigClient) -> None:
    """Stop a running rig: the torque ramps to zero, then the motor is disabled. Never refused.

    Ends when the motor is off; exit code 12 when it is not after 2 s. Where no daemon answers, `rtctl
    stop-rig CONFIG` makes the actuators torque-free by itself."""
    from rtctl.errors import ClientError

    # the reply says that the stop was taken in, not that the motor is off
    number, deadline = client.stop(), time.monotonic() + STOP_S
    # a tick of before the stop says nothing of after it: an arm may be on its way to the loop, too
    while (now := client.status())["enabled"] or now["command_seq_in_force"] < number:
        if time.monotonic() > deadline:  # whoever reaches for the joint next relies on the exit code
            raise ClientError(
                f"the stop was taken in, but after {STOP_S:g} s "
                + ("the motor is enabled" if now["enabled"] else "the loop has not taken it up")
                + ": press the emergency stop, or cut its power"
            )
        time.sleep(POLL_S)


@_operation("reset")
def reset(client: RigClient) -> None:
    """Leave FAULT or ESTOP once its cause has been gone for a second; in IDLE, say that a rig which was
    stopped for its friction may be armed as it is. Never arms."""
    client.reset()


def _tare(client: RigClient, hands_off: bool) -> None:
    """Take the present force as zero: at rest, with no hand on the device."""
    client.tare(hands_off=hands_off)


_HANDS = "nobody touches the device: tare, however much force the sensor shows"
tare = _operation("tare")(click.option("--hands-off", is_flag=True, help=_HANDS)(_tare))


def _adapt(client: RigClient, follow: str, axis: str | None) -> None:
    """Have the compensation follow the friction that is seen (on), or hold it where it is (off).

    Only where the rig file has adapt_per_min > 0 in [axis.friction.drift], since rtctl check judged no other
    friction than the learned one else."""
    client.set_adaptation(follow == "on", axis)


_adapt = click.option("--axis", help="the axis, by name; default: all that may follow")(_adapt)
adapt = _operation("adapt")(_adapt)
# first of the arguments: `rtctl adapt on RIG`
adapt.params.insert(0, click.Argument(["follow"], type=click.Choice(SWITCH)))


def lines(told: dict[str, Any]) -> list[str]:
    """The state for a person."""
    first, no_torque = told["fault_first"], words("no torque", of_axes(told["axes"]))
    out = [
        f"{told['rig']}: {told['state']}"
        + (f", authority {told['authority']:.0%}" if told["enabled"] else f", {no_torque}")
        + (", EMERGENCY STOP pressed" if told["estop"] else "")
    ]
    out += [f"  stopped by {first['name']}: {first['text']}"] if first else []
    # the first cause stands above already
    out += [f"  present: {fault['name']}: {fault['text']}" for fault in told["faults"] if fault != first]
    out += [f"  warning: {warning['text']}" for warning in told["warnings"]]
    out += [f"  not proved (rtctl check): {row}" for row in told.get("not_proved", ())]
    out += ["  without real-time rights (rtctl doctor)"] if told["waiver"] else []
    for axis, position, velocity in zip(
        told["axes"], told["position_rad"], told["velocity_rad_s"], strict=True
    ):
        of_axis = [
            f"  {axis['axis']}: {position:.4f} rad, {velocity:.4f} rad/s, environment "
            f"{axis['environment']['kind']}, compensation {axis['compensation']:.0%}"
            # get: a daemon of before tells none of these
            + _followed(axis.get("friction_factor", 1.0), adapting=axis.get("adapting")),
            *_display(axis["display"]),
            *_pulse(axis.get("measured", {})),
        ]
        out += [words(line, axis.get("motion", "rotary")) for line in of_axis]
    out += [f"  lease: {told['lease_holder']}"] if told["lease_holder"] else []
    return out


def _followed(factor: float, *, adapting: bool | None) -> str:
    """The friction that the compensation goes by, where it is not the one that was learned, and whether it
    goes on following it."""
    now = "" if factor == 1.0 else f" of {factor:.3f} times the learned friction"
    return now + {None: "", True: ", follows it", False: ", held there"}[adapting]


def _display(asked: dict[str, Any]) -> list[str]:
    """The virtual mass that an admittance is asked to show."""
    if asked["kind"] != "admittance":
        return []
    return [
        f"    admittance: mass {asked['mass_kgm2']:g} kg m^2, damping {asked['mass_damping_nms_rad']:g} N m "
        "s/rad"
    ]


def _pulse(measured: dict[str, float | None]) -> list[str]:
    """What the last test pulse found of the axis' torque, and what motion shows of it since."""
    gain, offset_nm = measured.get("gain"), measured.get("offset_nm")
    if gain is None or offset_nm is None:
        return []
    late = (
        f"{(measured['delay_s'] or 0.0) * 1e3:.3g} ms late at least (lag "
        f"{(measured['lag_s'] or 0.0) * 1e3:.3g})"
    )
    out = [f"    test pulse: current {gain:.3g} of what was sent, {offset_nm:+.3g} N m off, torque {late}"]
    running, running_nm = measured.get("running_gain"), measured.get("running_offset_nm")
    if running is not None and running_nm is not None:
        out.append(f"    running: current {running:.3g} of what is sent, {running_nm:+.3g} N m off")
    return out
