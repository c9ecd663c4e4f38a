"""Field maps out of a DBC file, by cantools. Host side: the loop gets the plain tables this makes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hw.interface import BackendError

if TYPE_CHECKING:
    from cantools.database import Database, Message, Signal

_ENTRY = {
    "channel",
    "axis",
    "message",
    "signal",
    "unit",
    "wrap",
    "wrap_at",
    "saturates",
    "limit",
    "value",
    "required",
    "period_ms",
}
_UNITS = {"deg": "deg", "degree": "deg", "°": "deg", "rad": "rad", "rev": "turn", "turn": "turn",
    "turns": "turn",
          "A": "A", "mA": "mA", "N": "N", "mN": "mN", "Nm": "Nm", "N m": "Nm", "mNm": "mNm", "degC": "degC",
          "°C": "degC",
          "rad/s": "rad/s", "deg/s": "deg/s", "°/s": "deg/s", "turn/s": "turn/s", "turns/s": "turn/s",
          "rev/s": "turn/s",
          "rpm": "rpm", "RPM": "rpm", "1/min": "rpm", "count/s": "count/s", "counts/s": "count/s",
          "m": "m", "mm": "mm", "um": "um", "m/s": "m/s", "mm/s": "mm/s", "kN": "kN",
          "C": "degC", "count": "count", "counts": "count"}  # fmt: skip


def load(path: Path) -> Database:
    """The database. Raises BackendError naming the file."""
    try:
        import cantools
    except ModuleNotFoundError as error:
        raise BackendError("reading a DBC needs cantools: pip install 'rtctl[can]'") from error
    try:
        # strict: signals that overlap or reach out of their frame are refused
        database = cantools.database.load_file(path, strict=True)
    except (OSError, ValueError, cantools.Error) as error:
        raise BackendError(f"{path}: cannot read the DBC file: {error}") from error
    if not isinstance(database, cantools.database.Database):
        raise BackendError(f"{path}: describes diagnostics (CDD), not the frames on a bus: give the DBC file")
    return database


def frames(
    path: Path, entries: Sequence[Any], received: Sequence[str], sent: Sequence[str]
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Tables for `receive` and `send` of the options, from entries naming a channel, a message and a signal.

    Raises
    ------
    BackendError
        Naming the file, and the message or signal it does not have or that cannot be used."""
    database = load(path)
    tables: dict[tuple[str, str, tuple[Any, ...]], dict[str, Any]] = {}
    for entry in entries:
        if not isinstance(entry, dict) or not {"channel", "message", "signal"} <= set(entry):
            raise BackendError(f"{path}: a signal needs channel, message and signal, not {entry!r}")
        unknown = set(entry) - _ENTRY
        if unknown:
            raise BackendError(f"{path}: unknown key {sorted(unknown)} of signal {entry['signal']!r}")
        channel = entry["channel"]
        if channel not in (*received, *sent):
            raise BackendError(f"{path}: no channel {channel!r}; one of {', '.join((*received, *sent))}")
        message = _message(database, path, str(entry["message"]))
        way = "receive" if channel in received else "send"
        signal = _signal(message, path, entry)
        chosen = _multiplexers(message, signal, path)
        key = way, message.name, tuple(value for _, value in chosen)
        # signals of one message under one multiplexer value are one frame, in the order of the rig file
        table = tables.setdefault(key, _frame(message, chosen, way))
        table["field"].append(_field(signal, entry))
        if way == "receive":  # a frame is required unless none of its signals is
            table["required"] = table.get("required", False) or entry.get("required", True)
            table |= {"period_ms": entry["period_ms"]} if "period_ms" in entry else {}
    return (
        [table for (way, *_), table in tables.items() if way == "receive"],
        [table for (way, *_), table in tables.items() if way == "send"],
    )


def _message(database: Database, path: Path, name: str) -> Message:
    try:
        message = database.get_message_by_name(name)
    except KeyError as error:
        known = ", ".join(sorted(one.name for one in database.messages)[:20])
        raise BackendError(f"{path}: no message {name!r}; it has {known}") from error
    return message


def _signal(message: Message, path: Path, entry: dict[str, Any]) -> Signal:
    try:
        return message.get_signal_by_name(entry["signal"])
    except KeyError as error:
        known = ", ".join(signal.name for signal in message.signals)
        raise BackendError(
            f"{path}: message {message.name} has no signal {entry['signal']!r}; it has {known}"
        ) from error


def _multiplexers(message: Message, signal: Signal, path: Path) -> list[tuple[Signal, int]]:
    """Signals that choose what the frame carries, and their values where it carries `signal`; outermost
    first."""
    chosen: list[tuple[Signal, int]] = []
    while signal.multiplexer_ids:
        if len(signal.multiplexer_ids) > 1:
            raise BackendError(
                f"{path}: signal {signal.name} of message {message.name} comes with several values of "
                f"{signal.multiplexer_signal}: {signal.multiplexer_ids}; describe the frame as "
                "[[device.options.receive]] with the select that is meant"
            )
        # the multiplexer of a multiplexer, until one stands in every frame of the message
        value, signal = (
            int(signal.multiplexer_ids[0]),
            message.get_signal_by_name(str(signal.multiplexer_signal)),
        )
        # a multiplexer may itself be multiplexed: the outermost is compared first
        chosen.insert(0, (signal, value))
    return chosen


def _frame(message: Message, chosen: list[tuple[Signal, int]], way: str) -> dict[str, Any]:
    table: dict[str, Any] = {
        "id": message.frame_id,
        "extended": message.is_extended_frame,
        "length": message.length,
        "field": [],
    }
    if way == "receive" and chosen:
        table["select"] = [{**_bits(signal), "value": value} for signal, value in chosen]
    elif chosen:  # the raw number, whatever the file says it means
        table["field"] = [
            {"channel": "constant", **_bits(signal), "value": value} for signal, value in chosen
        ]
    return table


def _bits(signal: Signal) -> dict[str, Any]:
    """Where its raw number lies."""
    return {
        "start_bit": signal.start,
        "bits": signal.length,
        "order": "little" if signal.byte_order == "little_endian" else "big",
        "type": "float" if signal.is_float else "int" if signal.is_signed else "uint",
    }


def _field(signal: Signal, entry: dict[str, Any]) -> dict[str, Any]:
    of_frame = ("message", "signal", "required", "period_ms")
    table = {
        **_bits(signal),
        "scale": float(signal.scale),
        "offset": float(signal.offset),
        **{key: value for key, value in entry.items() if key not in of_frame},
    }
    if "unit" not in table and signal.unit in _UNITS:
        table["unit"] = _UNITS[signal.unit]
    return table
