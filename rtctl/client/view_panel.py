"""What the page's panel shows beside the curves, and what its buttons do."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from hw.motion import name as own_name
from hw.motion import unit, words
from hw.outside import shown
from rtctl.client import RigClient
from rtctl.client.view_feed import Feed
from rtctl.client.view_guidance import hindrances, next_step, taken_apart
from rtctl.client.view_world import World
from rtctl.control.vocabulary import Display, Environment, Fault, Program, State
from rtctl.tick import FIELDS
from rtctl.wire.event_words import device_line
from rtctl.wire.fault_words import Entry, sentence

MOST_TEXT = 600
"""Characters of one text that the page shows."""

_NUMBERED = {
    "state": {int(state): state.name for state in State},
    "environment_kind": {int(kind): kind.word for kind in Environment},
    "display_kind": {int(kind): kind.name.lower() for kind in Display},
    "program_kind": {int(kind): kind.name.lower() for kind in Program},
    "fault_first": {-1: "none", **{fault.bit_length() - 1: str(fault.name) for fault in Fault}},
}
"""Signals whose numbers stand for names."""


def signals_of(hello: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Every curve this rig offers: `name`, `field` (of a linear axis with its units), `part` (axis, x, y, z,
    or empty), `unit`, `meaning`, `writer`, and `names` of the numbers that stand for something."""
    out: list[dict[str, Any]] = []
    axes = [axis["name"] for axis in hello["axes"]]
    moves = [axis.get("motion", "rotary") for axis in hello["axes"]]
    # of the table of the tick: a signal that is added is offered by itself
    for item in FIELDS:
        parts = {"scalar": [""], "axis": axes, "xyz": ["x", "y", "z"]}[item.shape]
        motions = moves if item.shape == "axis" else ["rotary"] * len(parts)
        out += [
            {
                "name": f"{item.name}.{i}",
                "field": own_name(item.name, motions[i]),
                "part": part,
                "unit": "" if item.unit == "1" else unit(item.unit, motions[i]),
                "meaning": words(item.meaning, motions[i]),
                "writer": item.writer,
                "names": _NUMBERED.get(item.name, {}),
            }
            for i, part in enumerate(parts)
        ]
    return out


def shown_table(table: Mapping[str, object]) -> dict[str, Any]:
    """The same as JSON has it and a page may show it: a number that is not finite is None, and no text has
    control characters or any that turn the line around."""
    return {shown(key): _shown_value(value) for key, value in table.items()}


def _shown_value(value: object) -> object:
    # devices and clients may have said anything
    if isinstance(value, str):
        return shown(value, MOST_TEXT)
    if isinstance(value, float):  # NaN and infinities, of which JSON has none
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return shown_table(value)
    if isinstance(value, list | tuple):
        return [_shown_value(one) for one in value]
    return value


def status(feed: Feed, world: World, motion: str = "rotary") -> dict[str, Any]:
    """What the panel shows beside the curves, of a rig that is told of in this motion."""
    health, rows = feed.health, feed.newest
    out: dict[str, Any] = {"silent": feed.silent, "silent_s": feed.silent_s}
    # before any tick, too: the world and the last health are known without one
    out |= {"health": health, "unread": feed.unread, "world": world.describe()}
    if rows is None:
        return out
    row = rows[0]  # the newest alone
    state, faults = State(int(row["state"])), int(row["faults"])
    cause = feed.places.cause(state, int(row["fault_first"]))
    return {
        **out,
        "state": state.name,
        "next": words(next_step(state, faults), motion),
        "hindrances": hindrances(state, faults, health.get("warnings", [])),
        "enabled": bool(row["enabled"]),
        "authority": float(row["authority"]),
        "faults": [_said(entry) for entry in feed.places.entries(faults)],
        "first": _said(cause) if cause else None,
        # a device that is content has nothing to say here
        "devices": [device_line(one) for one in health.get("devices", []) if one["faults"] or one["silent"]],
        "lease": bool(row["lease_held"]),
        "epoch": int(row["epoch"]),
        "missed": int(row["missed_ticks"]),
        "waiver": bool(row["waiver"]),
        "position_rad": row["position_rad"].tolist(),
        "velocity_rad_s": row["velocity_rad_s"].tolist(),
        "proxy_rad": row["proxy_position_rad"].tolist(),
        "hand_nm": row["hand_torque_nm"].tolist(),
        "applied_nm": row["torque_applied_nm"].tolist(),
        "environment": [Environment(int(kind)).word for kind in row["environment_kind"]],
        "display": [_display(row, axis) for axis in range(len(row["display_kind"]))],
        "compensation": row["compensation"].tolist(),
        "histogram": feed.histogram(),
    }


def _display(row: np.void, axis: int) -> dict[str, Any]:
    """What an axis shows now, and the damping that was added to it."""
    return {
        "kind": Display(int(row["display_kind"][axis])).name.lower(),
        "mass_kgm2": float(row["mass_kgm2"][axis]),
        "mass_damping_nms_rad": float(row["mass_damping_nms_rad"][axis]),
        "injected_nms_rad": float(row["injected_damping_nms_rad"][axis]),
    }


def _said(entry: Entry) -> Entry:
    """A fault with the line that a person reads, and its text taken apart: what is wrong, what to do."""
    # beside the sentence, which has both: the page sets what to do apart
    wrong, remedy = taken_apart(entry["name"], entry["text"])
    return {**entry, "sentence": sentence(entry), "wrong": wrong, "remedy": remedy}


def _arm(client: RigClient, _world: World, _body: dict[str, Any]) -> None:
    # the page shows the state as it changes; a thread must not wait 10 s for it
    client.arm(wait=False)


def _stop(client: RigClient, world: World, _body: dict[str, Any]) -> None:
    client.stop()  # first: what the world does meanwhile may take its time
    world.release()


def _reset(client: RigClient, _world: World, _body: dict[str, Any]) -> None:
    # likewise
    client.reset(wait=False)


def _tare(client: RigClient, _world: World, body: dict[str, Any]) -> None:
    client.tare(hands_off=body.get("hands") == "off")


def _compensation(client: RigClient, _world: World, body: dict[str, Any]) -> None:
    # of all axes: the page has one slider
    client.set_compensation(float(body["share"]))


def _set_display(client: RigClient, _world: World, body: dict[str, Any]) -> None:
    # what a body lacks keeps its value; a key that is none raises, and is told
    client.set_display(**body)


def _world(_client: RigClient, world: World, body: dict[str, Any]) -> dict[str, Any]:
    return world.choose(**body)


ACTIONS: dict[str, Callable[[RigClient, World, dict[str, Any]], Any]] = {
    "arm": _arm,
    "stop": _stop,
    "reset": _reset,
    "tare": _tare,
    "compensation": _compensation,
    "display": _set_display,
    "world": _world,
}
"""Buttons by name; all but `stop` need the operator key."""
