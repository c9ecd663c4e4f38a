"""How full the bus gets: worst-case bits of every frame, times how often it is sent. Pure arithmetic.

Classic frames after Davis et al. 2007 (Real-Time Systems 35, 239-272): 8 n data bits and g other bits that
are stuffed (34 standard, 54 extended), one stuff bit for every four bits at worst, 13 bits unstuffed
(3 of them the pause between frames). CAN FD after ISO 11898-1:2015: the data phase has its own bit rate,
its CRC has fixed stuff bits."""

from __future__ import annotations

from dataclasses import dataclass

# lengths that the four bits of a CAN FD frame can say (ISO 11898-1)
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)


@dataclass(frozen=True)
class Traffic:
    """One kind of frame: `per_s` times a second. `fd` frames send their data at the data bit rate."""

    name: str
    length: int
    per_s: float
    extended: bool = False
    fd: bool = False
    remote: bool = False


@dataclass(frozen=True)
class Load:
    """What a set of frames asks of a bus."""

    share: float
    """Worst-case share of the wire's time, 1 is full."""
    cycle_s: float
    """Worst-case time on the wire of the frames of one loop period, one after the other."""
    lines: tuple[str, ...]
    """One line per kind of frame."""


def fd_length(length: int) -> int:
    """Smallest CAN FD length that holds `length` bytes (0 to 64)."""
    return next(size for size in FD_LENGTHS if size >= length)


def classic_bits(length: int, *, extended: bool = False, stuffed: bool = True) -> int:
    """Bits of a classic frame with `length` data bytes and the pause after it; at worst, or with no stuff
    bit."""
    # bits that are stuffed; delimiters, acknowledge, end of frame and pause are not
    # a remote frame is asked for with length 0: the same head, no data
    guarded = (54 if extended else 34) + 8 * length
    return guarded + 13 + ((guarded - 1) // 4 if stuffed else 0)


def fd_bits(length: int, *, extended: bool = False) -> tuple[int, int]:
    """Worst-case bits of a CAN FD frame with `length` data bytes: at the nominal rate, at the data rate."""
    # what is padded is on the wire, too
    length = fd_length(length)
    arbitration = 36 if extended else 17  # start of frame up to the bit-rate switch
    data = 1 + 4 + 8 * length  # error state, length code, data
    # beyond 16 bytes the longer polynomial of ISO 11898-1
    crc = 4 + (17 if length <= 16 else 21)  # stuff count and checksum
    # one before the field and one behind every four of its bits, whatever they are (ISO 11898-1)
    fixed_stuff = 1 + (crc - 1) // 4
    nominal = arbitration + (arbitration - 1) // 4 + 1 + 1 + 7 + 3  # acknowledge, its delimiter, end, pause
    # stuffed up to the checksum, which has its own; 1: its delimiter
    return nominal, data + data // 4 + crc + fixed_stuff + 1


def frame_s(frame: Traffic, bitrate: int, data_bitrate: int) -> float:
    """Worst-case time of one frame on the wire, s."""
    if not frame.fd:
        return classic_bits(0 if frame.remote else frame.length, extended=frame.extended) / bitrate
    nominal, data = fd_bits(frame.length, extended=frame.extended)
    return nominal / bitrate + data / data_bitrate


def bus_load(frames: list[Traffic], bitrate: int, data_bitrate: int, period_s: float) -> Load:
    """Load of the bus by `frames`; those sent at least once a loop period make up the cycle.

    Parameters
    ----------
    frames
        All kinds of frames of the bus, both directions.
    bitrate, data_bitrate
        Bits per second of the arbitration phase (all of a classic frame) and of an FD frame's data phase.
    period_s
        Period of the loop."""
    share, cycle_s, lines = 0.0, 0.0, []
    for frame in frames:
        seconds = frame_s(frame, bitrate, data_bitrate)
        share += seconds * frame.per_s
        # slower ones are missing in most cycles: they count in the share, not in the length of a cycle
        if frame.per_s * period_s >= 1.0 - 1e-9:  # a rate that is the loop's own may come out a hair below it
            cycle_s += seconds * frame.per_s * period_s
        lines.append(
            f"{frame.name}: {frame.length} bytes, {frame.per_s:g}/s, {1e6 * seconds:.0f} us each at worst, "
            f"{100 * seconds * frame.per_s:.1f} %"
        )
    return Load(share, cycle_s, tuple(lines))


def fault(load: Load, bitrate: int, period_s: float, limit: float) -> str | None:
    """Why these frames must not be tried on this bus, with the numbers; None if they fit."""
    # the share alone: a cycle whose frames do not fit into its period has a share above 1 already
    if load.share <= limit:
        return None
    return (
        f"the frames need {100 * load.share:.0f} % of the bus at {bitrate / 1e6:g} Mbit/s, at most "
        f"{100 * limit:.0f} % is allowed (load_limit); those of one period take {1e6 * load.cycle_s:.0f} us "
        f"of {1e6 * period_s:.0f} us: lower [loop] rate_hz, use fewer axes per bus, a higher bitrate, or "
        "CAN FD. " + "; ".join(load.lines)
    )
