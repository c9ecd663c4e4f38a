"""docs/config.md from the models: a table for every table of a rig file, a row for every key.

Read off the JSON Schema that pydantic makes of the models, in which bounds, defaults and meanings stand
together however a type is put together.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from hw import registry

Schema = Mapping[str, Any]

UNITS = {
    "drift_n_sqrt_s": "N/sqrt(s)",
    "counts_per_n": "counts/N",
    "adapt_per_min": "1/min",
    "dry_per_c": "1/degC",
    "viscous_per_c": "1/degC",
    "outside_square_nm": "1/(N m)",
    "motor_square_nm": "1/(N m)",
    "bitrate": "bit/s",
    "data_bitrate": "bit/s",
    "baud": "bit/s",
}
"""Units of the keys that do not end with their unit."""

ENDINGS = {
    "nms_rad": "N m s/rad",
    "nm_rad": "N m/rad",
    "nm_s": "N m/s",
    "nm_a": "N m/A",
    "nm": "N m",
    "rad_s": "rad/s",
    "rad": "rad",
    "kgm2": "kg m^2",
    "counts_per_rev": "counts",
    "counts_per_turn": "counts",
    "counts": "counts",
    "ticks": "ticks",
    "hz": "Hz",
    "minutes": "min",
    "us": "us",
    "ms": "ms",
    "s": "s",
    "mb": "MB",
    "m": "m",
    "n": "N",
    "j": "J",
    "w": "W",
    "a": "A",
    "c": "degC",
}
"""Units by the end of a key, the longest first."""


def unit(key: str) -> str:
    """Unit of a key by its name; "" for a number without one, a switch or a word."""
    if key in UNITS:
        return UNITS[key]
    return next((text for end, text in ENDINGS.items() if key == end or key.endswith(f"_{end}")), "")


KINDS = {
    "mock": "Simulated rig: motor, gearbox, friction, sensors, a hand",
    "playback": "A recorded log (CSV) as the sensor stream",
    "serial": "A board on a serial port that speaks rtctl-frame (docs/serial-protocol.md)",
    "serial-described": "A board on a serial port with a frame of its own, described in the rig file "
    "(docs/serial-described.md)",
    "serial-lines": "A board on a serial port that prints and takes lines of text (docs/serial-lines.md)",
    "rokubi": "Force sensor: Bota Systems Rokubi, SensONE, LaxONE on a serial port",
    "optoforce": "Force sensor: OptoForce / OnRobot DAQ on a serial port",
    "rdt": "Force sensor: ATI Net F/T and Axia, OnRobot HEX, Schunk over UDP (RDT)",
    "can": "A board on a CAN bus, by a field map or a DBC file",
    "odrive": "ODrives over CAN Simple",
    "moteus": "Moteus controllers over CAN-FD",
    "cia402": "CANopen drives (CiA 402) in cyclic synchronous torque",
}
"""What each kind of device is, below its heading."""


def rig_file() -> str:
    """Tables of the rig file itself, as Markdown."""
    from rtctl.rig_file.config import Config

    return "\n".join(_Pages().pages(Config.model_json_schema(by_alias=True), "", "##"))


def device_options() -> str:
    """Tables of `[device.options]` of every kind that comes with rtctl, as Markdown."""
    pages, out = _Pages(), []
    for kind in registry.BUILT_IN:
        out += [f'## `kind = "{kind}"`', "", f"{KINDS[kind]}.", ""]
        schema = registry.options_model(kind).model_json_schema(by_alias=True)
        out += pages.pages(schema, "device.options", "###")
    return "\n".join(out)


@dataclass
class _Pages:
    """Writes tables, each model once: where it comes again, a link says where it stands."""

    seen: dict[str, tuple[str, str]] = field(default_factory=dict)
    anchors: dict[str, int] = field(default_factory=dict)

    def pages(self, schema: Schema, path: str, level: str) -> Iterator[str]:
        """Lines of the table `schema` at `path` and of all tables inside it."""
        yield from self._table(schema, schema.get("$defs", {}), path, f"[{path}]" if path else "", level)

    def _table(self, table: Schema, models: Schema, path: str, heading: str, level: str) -> Iterator[str]:
        if heading:
            yield from (f"{level} `{heading}`", "")
        same = json.dumps(table, sort_keys=True, default=str)
        if same in self.seen and path != "device.options":
            first, anchor = self.seen[same]
            self._anchor(heading)
            yield from (f"Keys as in [`{first}`](#{anchor}).", "")
            return
        self.seen[same] = (heading, self._anchor(heading))
        text = table.get("description", "").split("\n\n")[0].replace("\n", " ")
        after = text.partition("]: ")[2] if text.startswith("[") else text
        after = after if heading else ""
        if after:
            yield from (f"{after[0].upper()}{after[1:].rstrip('.')}.", "")
        tables, rows = [], []
        for key, one in table.get("properties", {}).items():
            inside, many = _table_in(one, models)
            if inside is None:
                rows.append(_row(key, one, models, required=key in table.get("required", ())))
                continue
            name = f"{path}.{key}" if path else key
            tables.append((inside, name, f"[[{name}]]" if many else f"[{name}]"))
        if rows:
            yield from ("| key | unit | bounds | default | meaning |", "|---|---|---|---|---|", *rows, "")
        for inside, name, title in tables:
            yield from self._table(inside, models, name, title, level)

    def _anchor(self, heading: str) -> str:
        """Anchor of a heading, as GitHub numbers it."""
        name = "".join(letter for letter in heading if letter.isalnum() or letter in "_-")
        self.anchors[name] = self.anchors.get(name, -1) + 1
        return f"{name}-{self.anchors[name]}" if self.anchors[name] else name


def _table_in(one: Schema, models: Schema) -> tuple[Schema | None, bool]:
    """The model that a key holds, and whether it holds several of them; None for a plain key."""
    if "$ref" in one:
        return models[one["$ref"].rpartition("/")[2]], False
    for part in one.get("anyOf", ()):
        found, many = _table_in(part, models)
        if found is not None:
            return found, many
    inner = one.get("items") or next(iter(one.get("prefixItems", ())), None)
    if isinstance(inner, Mapping) and "$ref" in inner:
        return _table_in(inner, models)[0], True
    return None, False


def _row(key: str, one: Schema, models: Schema, *, required: bool) -> str:
    default = "required" if required else _value(one.get("default"))
    cells = (f"`{key}`", unit(key), _bounds(one, models), default, one.get("description", ""))
    return "| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"


def _value(value: object) -> str:
    """A default as the rig file would have it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:g}" if float(f"{value:g}") == value else repr(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, dict):
        return "none"
    return json.dumps(value) if isinstance(value, str) else str(value)


def _bounds(one: Schema, models: Schema) -> str:
    """What a value may be."""
    if "anyOf" in one:
        parts = [_bounds(part, models) for part in one["anyOf"] if part.get("type") != "null"]
        return " or ".join(dict.fromkeys(parts))
    if "const" in one:
        return f"only {_value(one['const'])}"
    if "enum" in one:
        return ", ".join(_value(item) for item in one["enum"])
    kind = one.get("type")
    if kind == "array":
        return _list(one, models)
    if kind == "string":
        return _text(one)
    if kind == "boolean":
        return "true, false"
    return _range(one) if kind in ("number", "integer") else "a table"


def _range(one: Schema) -> str:
    whole = "whole, " if one.get("type") == "integer" else ""
    low, high = one.get("minimum"), one.get("maximum")
    if low is None and high is None:
        return f"{whole}finite"
    if low is None and "exclusiveMinimum" in one:
        return f"{whole}above {_number(one['exclusiveMinimum'])}, to {_number(one['maximum'])}"
    return f"{whole}{_number(one['minimum'])} to {_number(one['maximum'])}"


def _number(value: float) -> str:
    return f"{value:.10g}" if abs(value) < 1e15 else f"{value:.3g}"


def _text(one: Schema) -> str:
    if "pattern" in one:
        return f"text as `{one['pattern']}`"
    return f"text of at most {one['maxLength']} characters" if "maxLength" in one else "text"


def _list(one: Schema, models: Schema) -> str:
    """A list, how long, and of what."""
    inner = one.get("prefixItems")
    if inner:
        parts = [_bounds(item, models) for item in inner]
        same = len(set(parts)) == 1
        return f"list of {len(parts)}: " + (f"each {parts[0]}" if same else "; ".join(parts))
    most = f"at most {one['maxItems']}" if "maxItems" in one else "any number"
    return f"list of {most}: each {_bounds(one.get('items', {}), models)}"
