"""How late a drive or board on a CAN bus is at worst, for `rtctl check`. Plain arithmetic; imports no driver.

Asked for, a sample is taken when its request (or the SYNC) arrives, in the cycle before the one that reads
it, and the command that answers it arrives at the same place of the next cycle: one period, the time on the
bus included in both. What a device sends by a clock of its own is up to that clock's period old when it is
read, and both frames need their turn on the bus besides: all frames of one period, one after the other. That
much may come and go."""

from __future__ import annotations

from hw.can import board_backend as board
from hw.can import moteus_codec, odrive_codec
from hw.can.board_map import factor, make_field
from hw.can.load import Traffic, bus_load
from hw.can.sample import Shaft
from hw.field_units import force_numbers
from hw.interface import Options, Rig, Shown, Timing


def _cycle_s(frames: list[Traffic], options: Options, rig: Rig) -> float:
    """Time on the wire of the frames of one period."""
    bus = options["bus"]
    return bus_load(frames, int(bus["bitrate"]), int(bus["data_bitrate"]), rig.period_s).cycle_s


def _asked(cycle_s: float, rig: Rig) -> list[Timing]:
    # jitter is no more than a period: a frame that is later belongs to the next
    return [Timing(rig.period_s, rig.period_s, min(cycle_s, rig.period_s))] * rig.n_axes


def _by_itself(period_s: float, cycle_s: float, rig: Rig) -> list[Timing]:
    return [Timing(period_s + cycle_s, period_s, min(cycle_s, period_s))] * rig.n_axes


def odrive_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of ODrives: asked in every cycle, or sending by themselves."""
    cycle_s = _cycle_s(odrive_codec.traffic(options, 1 / rig.period_s), options, rig)
    if options["feedback"] == "request":
        return _asked(cycle_s, rig)
    return _by_itself(1e-3 * float(options["feedback_ms"]), cycle_s, rig)


def moteus_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of moteus controllers: a command asks for the sample."""
    return _asked(_cycle_s(moteus_codec.traffic(options, 1 / rig.period_s), options, rig), rig)


def cia402_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of CiA 402 drives: sample and command are both taken at the SYNC."""
    return [Timing(rig.period_s, rig.period_s)] * rig.n_axes


def board_timing(options: Options, rig: Rig) -> list[Timing]:
    """Timing of a board by field map: its slowest required frame, sent by itself, or once a cycle."""
    cycle_s = _cycle_s(board.traffic(options, 1 / rig.period_s), options, rig)
    periods_s = [
        1e-3 * float(frame.get("period_ms") or 0) for frame in options["receive"] if frame["required"]
    ]
    return _by_itself(max([rig.period_s, *periods_s]), cycle_s, rig)


def cia402_shown(options: Options, rig: Rig) -> Shown:
    """Steps of the position units of CiA 402 drives."""
    return Shown(
        tuple(
            abs(Shaft(table, rig, axis).rad_per_turn) / float(table["counts_per_turn"])
            for axis, table in enumerate(options["axis"])
        ),
        True,
        # per mille of 6075; where the drive tells that itself nothing is known
        tuple(1e-3 * float(table["rated_current_a"] or 0.0) for table in options["axis"]),
    )


def board_shown(options: Options, rig: Rig) -> Shown:
    """Steps and ends of the whole numbers in a field map."""
    steps: dict[str, list[float]] = {name: [0.0] * rig.n_axes for name in ("position", "current")}
    forces = []
    for frame in options["receive"]:
        for table in frame["field"]:
            field = make_field(table, int(frame["length"]))
            if field.kind == "float":
                continue
            unit = factor(table, rig)
            if table["channel"] in steps:
                steps[table["channel"]][table["axis"]] = abs(unit * field.scale)
            elif table["channel"] == "force":
                ends = [abs(unit * (field.scale * raw + field.offset)) for raw in field.raw_range]
                forces.append((abs(unit * field.scale), min(ends)))
    return Shown(tuple(steps["position"]), False, tuple(steps["current"]), *force_numbers(forces))
