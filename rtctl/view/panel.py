"""What the page's panel shows beside the curves, and what its buttons do."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from rtctl.client import RigClient
from rtctl.control.vocabulary import Environment, State
from rtctl.fault_words import Entry, sentence
from rtctl.host.speaker import device_line
from rtctl.tick import FIELDS
from rtctl.view.feed import Feed
from rtctl.view.world import World


def signals_of(hello: Mapping[str, Any]) -> list[dict[str, str]]:
    """Every curve this rig offers, with unit and meaning."""
    out = []
    axes = [axis["name"] for axis in hello["axes"]]
    for item in FIELDS:
        labels = {"scalar": [""], "axis": axes, "xyz": ["x", "y", "z"]}[item.shape]
        out += [
            {
                "name": f"{item.name}.{i}",
                "label": f"{item.name} {label}".strip(),
                "unit": item.unit,
                "meaning": item.meaning,
            }
            for i, label in enumerate(labels)
        ]
    return out


def status(feed: Feed, world: World) -> dict[str, Any]:
    """What the panel shows beside the curves."""
    health, rows = feed.health, feed.newest
    out: dict[str, Any] = {"silent": feed.silent, "health": health, "world": world.describe()}
    if rows is None:
        return out
    row = rows[0]
    cause = feed.places.cause(int(row["state"]), int(row["fault_first"]))
    return {
        **out,
        "state": State(int(row["state"])).name,
        "enabled": bool(row["enabled"]),
        "authority": float(row["authority"]),
        "faults": [_said(entry) for entry in feed.places.entries(int(row["faults"]))],
        "first": _said(cause) if cause else None,
        "devices": [device_line(one) for one in health.get("devices", []) if one["faults"] or one["silent"]],
        "lease": bool(row["lease_held"]),
        "epoch": int(row["epoch"]),
        "missed": int(row["missed_ticks"]),
        "waiver": bool(row["waiver"]),
        "position_rad": row["position_rad"].tolist(),
        "proxy_rad": row["proxy_position_rad"].tolist(),
        "hand_nm": row["hand_torque_nm"].tolist(),
        "applied_nm": row["torque_applied_nm"].tolist(),
        "environment": [Environment(int(kind)).name.lower() for kind in row["environment_kind"]],
        "compensation": row["compensation"].tolist(),
        "histogram": feed.histogram(),
    }


def _said(entry: Entry) -> Entry:
    """A fault with the line that a person reads."""
    return {**entry, "sentence": sentence(entry)}


def _arm(client: RigClient, _world: World, _body: dict[str, Any]) -> None:
    client.arm(wait=False)


def _stop(client: RigClient, world: World, _body: dict[str, Any]) -> None:
    client.stop()  # first: what the world does meanwhile may take its time
    world.release()


def _reset(client: RigClient, _world: World, _body: dict[str, Any]) -> None:
    client.reset(wait=False)


def _tare(client: RigClient, _world: World, _body: dict[str, Any]) -> None:
    client.tare()


def _compensation(client: RigClient, _world: World, body: dict[str, Any]) -> None:
    client.set_compensation(float(body["share"]))


def _world(_client: RigClient, world: World, body: dict[str, Any]) -> dict[str, Any]:
    return world.choose(**body)


ACTIONS: dict[str, Callable[[RigClient, World, dict[str, Any]], Any]] = {
    "arm": _arm,
    "stop": _stop,
    "reset": _reset,
    "tare": _tare,
    "compensation": _compensation,
    "world": _world,
}
"""Buttons by name; all but `stop` need the operator key."""
