"""The tick record: every signal of one control cycle, named once, with unit, shape and meaning.

A tick is one row of this structured dtype. The backend writes the measured fields, the compiled law the rest;
the ring, telemetry, recordings, plots, the JSON Schema and the table in `docs/tick.md` are all generated from
`FIELDS`. Every per-axis field has shape `(n_axes,)`, also on a one-axis rig.

Signs (docs/theory.md 1.1): link side, after the gearbox. A torque is positive when it accelerates the joint
towards positive position, whoever applies it. Power into the device from the hand is
`hand_torque_nm * velocity_rad_s`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, NamedTuple

import numpy as np

from hw.channels import READINGS, Reading
from hw.motion import unit

Kind = Literal["int", "float", "bits"]
Shape = Literal["scalar", "axis", "xyz"]
Writer = Literal["loop", "backend", "law"]

MOST_AXES = 8
"""Axes of a rig, and of what claims to be recorded from one."""

_NUMPY = {"int": "<i8", "float": "<f8", "bits": "<u8"}


@dataclass(frozen=True)
class Field:
    """One signal: name (with its unit), kind, shape, unit, who writes it, and one line of meaning."""

    name: str
    kind: Kind
    shape: Shape
    unit: str
    writer: Writer
    meaning: str

    def dtype(self, n_axes: int) -> tuple[Any, ...]:
        """NumPy field descriptor for a rig of `n_axes` axes."""
        if self.shape == "scalar":
            return (self.name, _NUMPY[self.kind])
        return (self.name, _NUMPY[self.kind], (n_axes if self.shape == "axis" else 3,))


def _loop(name: str, unit: str, meaning: str) -> Field:
    return Field(name, "int", "scalar", unit, "loop", meaning)


def _plain(name: str, kind: Kind, meaning: str, shape: Shape = "scalar", writer: Writer = "law") -> Field:
    return Field(name, kind, shape, "1", writer, meaning)


def _axis(name: str, unit: str, meaning: str) -> Field:
    return Field(name, "float", "axis", unit, "law", meaning)


def _reading(reading: Reading) -> Field:
    kind: Kind = "int" if reading.shape == "scalar" else "float"
    return Field(reading.field, kind, reading.shape, reading.unit, "backend", reading.meaning)


FIELDS: tuple[Field, ...] = (
    # time: written by the loop
    _loop("tick", "1", "slot on the absolute time grid; a gap means missed ticks"),
    _loop("time_ns", "ns", "deadline of this tick on CLOCK_MONOTONIC (virtual clock: tick times period)"),
    _loop("wakeup_ns", "ns", "how late the loop woke up, after time_ns"),
    _loop("read_ns", "ns", "duration of reading the devices"),
    _loop("law_ns", "ns", "duration of command intake and compiled law"),
    _loop("write_ns", "ns", "duration of writing to the devices"),
    _loop("record_ns", "ns", "duration of recording the previous tick"),
    _loop("cycle_ns", "ns", "wake-up to end of write, plus record_ns: the work of one cycle"),
    _loop("missed_ticks", "1", "grid slots skipped since the loop started"),
    _loop("waiver", "1", "1 while the rig runs without granted real-time rights"),
    # measured: written by the backend
    _plain("sample_count", "int", "device sample counter; must advance for a fresh sample", writer="backend"),
    _plain("link_faults", "bits", "faults of the link this cycle (hw.interface.LinkFault)", writer="backend"),
    *(_reading(reading) for reading in READINGS),
    # command in force: copied by the law from the newest command
    _plain("command_seq", "int", "sequence number of the command in force"),
    _plain("target_age_ticks", "int", "ticks since the renderer's last target"),
    _plain("lease_held", "int", "1 while a renderer holds the lease to send targets"),
    _plain("targets_refused", "int", "targets refused so far: void epoch, no lease, not finite"),
    _plain("environment_kind", "int", "virtual environment in force (control.environments)", shape="axis"),
    _plain("display_kind", "int", "display in force (control.vocabulary.Display)", shape="axis"),
    _axis("mass_kgm2", "kg m^2", "virtual mass in force; 0 where an impedance is displayed"),
    _axis("mass_damping_nms_rad", "N m s/rad", "its damping in force, without what is injected"),
    _axis("compensation", "1", "share of the configured friction feed-forward in force, 0 to 1"),
    _axis("friction_factor", "1", "factor of the learned friction that the feed-forward goes by, .7 to 1.1"),
    # estimates
    _plain("sample_age_ticks", "int", "ticks since the last valid sample; 0 is fresh"),
    _axis("velocity_rad_s", "rad/s", "velocity from the positions, by the configured estimator"),
    _axis("velocity_difference_rad_s", "rad/s", "plain backward difference, as the coupling uses it"),
    _axis("motor_torque_nm", "N m", "torque of the motor at the link, from the measured current"),
    _axis("hand_torque_nm", "N m", "torque of the hand on the joint: tared, low-passed"),
    _axis("hand_torque_raw_nm", "N m", "torque of the hand on the joint before tare and filter"),
    Field(
        "force_tared_n",
        "float",
        "xyz",
        "N",
        "law",
        "force of the hand, sensor axes: less tare and weight of the tip",
    ),
    Field(
        "moment_tared_nm",
        "float",
        "xyz",
        "N m",
        "law",
        "moment of the hand about the sensor's origin, likewise; 0 where the rig file does not use moments",
    ),
    _axis(
        "force_offset_nm",
        "N m",
        "what the force sensor shows too much by the friction it sees in both directions; NaN until both "
        "have slid",
    ),
    # law
    _axis("proxy_position_rad", "rad", "position of the virtual object behind the coupling"),
    _axis(
        "coupling_torque_nm", "N m", "torque of the virtual coupling on the joint (minus the virtual force)"
    ),
    _axis(
        "friction_model_nm", "N m", "learned friction magnitude at this speed, 0 outside the trained range"
    ),
    _axis(
        "place_trust",
        "1",
        "share of what the model says of this place that is believed, 0 to 1; 0 for a model without places",
    ),
    _axis("friction_observed_nm", "N m", "dry friction that force sensor and encoder show, along the motion"),
    _axis("friction_sign", "1", "direction given to the feed-forward, -1 to 1"),
    _axis("friction_gate", "1", "force gate of the feed-forward, 0 to 1"),
    _axis("feedforward_torque_nm", "N m", "friction feed-forward"),
    _axis(
        "observer_torque_nm",
        "N m",
        "torque of the disturbance observer: friction that the feed-forward leaves",
    ),
    _axis(
        "assistance_share", "1", "share of feed-forward and observer that their energy account allows, 0 to 1"
    ),
    _axis("injected_damping_nms_rad", "N m s/rad", "damping added by the passivity controller"),
    _axis("damping_torque_nm", "N m", "torque of that damping and of HOLD"),
    _plain("program_kind", "int", "excitation program in force (control.program), 0 none", shape="axis"),
    _plain("program_flags", "bits", "why the program ended in BRAKE (ProgramFlag)", shape="axis"),
    _axis("program_torque_nm", "N m", "torque of the excitation program, which replaces the law's others"),
    _axis("torque_wanted_nm", "N m", "sum of the law's torques, before authority and gate"),
    _axis(
        "torque_share",
        "1",
        "share of the torque limit that state, temperature, waiver and 250 ms window leave",
    ),
    _axis("torque_applied_nm", "N m", "torque sent: after authority and gate"),
    _axis("current_command_a", "A", "motor current sent"),
    _axis(
        "energy_port_j",
        "J",
        "passivity observer: energy the controller has absorbed, with credited dissipation",
    ),
    _axis("energy_hand_j", "J", "net energy the hand has put into the device"),
    _axis("energy_feedforward_j", "J", "net energy that feed-forward and observer have put into the device"),
    # what was measured of the actuator: NaN (null in JSON) where it was not
    _axis(
        "arming_delay_ticks",
        "1",
        "delay of the motor's current behind what was sent, lag included, by the test pulse: at least this "
        "much",
    ),
    _axis("arming_lag_ticks", "1", "of that the time constant of the current loop"),
    _axis("arming_gain", "1", "current measured over sent, by the test pulse"),
    _axis("arming_offset_nm", "N m", "torque that the current shows beyond what was sent, by the test pulse"),
    _axis(
        "running_delay_ticks", "1", "the delay as ordinary motion shows it: the last window that could tell"
    ),
    _axis("running_gain", "1", "current measured over sent, likewise"),
    _axis("running_offset_nm", "N m", "torque that the current shows beyond what was sent, likewise"),
    # state
    _plain("state", "int", "state of the machine (control.vocabulary.State)"),
    _plain("enabled", "int", "1 when the actuator is to be enabled"),
    _plain("authority", "float", "soft-start share of the torque, 0 to 1"),
    _plain("epoch", "int", "increases at every stop; commands of an older epoch are void"),
    _plain("faults", "bits", "faults present now (control.vocabulary.Fault)"),
    _plain("fault_first", "int", "bit number of the latched first cause, -1 without"),
    _plain("gate_flags", "bits", "what the gate did to the torque (control.gate)", shape="axis"),
    # integrity
    _plain("seal", "bits", "checksum of the row, last word; set when it is recorded", writer="loop"),
)

FIELD: dict[str, Field] = {field.name: field for field in FIELDS}


@cache
def tick_dtype(n_axes: int = 1) -> np.dtype[np.void]:
    """Structured dtype of a tick of a rig with `n_axes` axes (little endian, 8-byte words throughout)."""
    if n_axes < 1:
        raise ValueError(f"n_axes must be at least 1, not {n_axes}")
    return np.dtype([field.dtype(n_axes) for field in FIELDS])


class Word(NamedTuple):
    """Dtype, shape within a record and place, in words, of a field that is one word of 8 bytes."""

    dtype: str
    shape: tuple[int, ...]
    place: int


@cache
def single_words(record: np.dtype[np.void]) -> dict[str, Word]:
    """The fields of such records that are one word each: those can be copied many at a time."""
    fields = {name: (part[0], part[1]) for name, part in (record.fields or {}).items()}
    return {
        name: Word(dtype.base.str, dtype.shape, place // 8)
        for name, (dtype, place) in fields.items()
        if dtype.itemsize == dtype.base.itemsize == 8 and not place % 8 and not record.itemsize % 8
    }


def new_ticks(n: int = 1, n_axes: int = 1) -> np.ndarray:
    """`n` zeroed ticks."""
    return np.zeros(n, tick_dtype(n_axes))


def forget(rows: np.ndarray, names: Iterable[str]) -> None:
    """Have ticks, shape (n,), say nothing of these fields: NaN, and 0 in whole numbers, which have none."""
    for name in names:
        rows[name] = np.nan if rows.dtype[name].base.kind == "f" else 0


def copied(rows: np.ndarray) -> np.ndarray:
    """A copy of ticks or other records, shape (n,).

    NumPy itself copies records field by field (.07 ms for a batch of 80 ticks, .14 ms for a state of the
    law); here they are bytes."""
    return np.frombuffer(bytearray(rows.tobytes()), rows.dtype)


def joined(batches: Sequence[np.ndarray]) -> np.ndarray:
    """Batches of ticks of one rig, at least one, as one array.

    NumPy itself compares the fields of each batch with those of the others (0.1 ms); here they are bytes."""
    if len(batches) == 1:
        return batches[0]
    whole = np.dtype((np.void, batches[0].dtype.itemsize))
    return np.concatenate([np.ascontiguousarray(batch).view(whole) for batch in batches]).view(
        batches[0].dtype
    )


def json_schema(n_axes: int = 1, motions: Sequence[str] = ()) -> dict[str, Any]:
    """JSON Schema of one tick as telemetry and recordings carry it.

    Per-axis fields are arrays of `n_axes` numbers. A non-finite number is written as null. `motions` of the
    axes, none: all rotary. The names are those of a rotary axis; the units are those of each axis, in their
    order where they differ."""
    properties: dict[str, Any] = {}
    for field in FIELDS:
        leaf: dict[str, Any] = {"type": ["number", "null"] if field.kind == "float" else "integer"}
        if field.kind == "bits":
            leaf["minimum"] = 0
        units = [unit(field.unit, motion) for motion in motions] if field.shape == "axis" else []
        text = f"{field.meaning} [{', '.join(units if len(set(units)) > 1 else units[:1] or [field.unit])}]"
        if field.shape == "scalar":
            properties[field.name] = {**leaf, "description": text}
        else:
            length = n_axes if field.shape == "axis" else 3
            properties[field.name] = {
                "type": "array",
                "items": leaf,
                "minItems": length,
                "maxItems": length,
                "description": text,
            }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "rtctl tick",
        "type": "object",
        "properties": properties,
        "required": [field.name for field in FIELDS],
        "additionalProperties": False,
    }
