"""The keys of a linear axis: those of a rotary one with the endings of m and N, turned into them where a rig
file is read.

`torque_limit_n` is read as `torque_limit_nm`, `position_min_m` as `position_min_rad`, bounds in the same
numbers. A device whose axes are all linear has its options so, too; one that serves axes of both motions, the
tables that it has one per axis. The rotary name of such a key is refused: it would mean another unit than it
says."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel

from hw import registry
from hw.interface import BackendError
from hw.motion import at_handle, name, words
from hw.plain_words import Key, written
from rtctl.rig_file.axis_tables import AxisTable

Where = Callable[[Key], str]

PER_AXIS = ("axis", "hand")
"""Options that are one table for all axes of a device, or one per axis."""


class LinearKeys:
    """The tables of a rig file with the keys of a rotary axis, and where each of them came from.

    Attributes
    ----------
    data
        The whole file, ready to be validated.
    faults
        One line for each key of a linear axis that has the name of a rotary one."""

    def __init__(self, data: dict[str, Any], where: Where) -> None:
        self._own: dict[Key, Key] = {}
        self._where = where
        self.faults: list[str] = []
        self.data = data
        axes = data.get("axis")
        linear = [isinstance(one, dict) and one.get("motion") == "linear" for one in _list(axes)]
        # nothing is to be turned: where no axis slides the file stays as it was read
        self._linear = linear if any(linear) else []
        if not any(linear):
            return
        renamed = [
            with_defaults(self._table(one, AxisTable, ("axis", k), ("axis", k)), AxisTable)
            if linear[k]
            else one
            for k, one in enumerate(_list(axes))
        ]
        self.data = {**data, "axis": renamed}
        names = [one.get("name") if isinstance(one, dict) else None for one in _list(axes)]
        devices = _list(data.get("device"))
        served = [[linear[i] for i in _served(one, names)] for one in devices]
        self._tables = _of_linear_axes(linear, served)
        if devices:
            self.data["device"] = [
                self._device(k, one, its) if isinstance(one, dict) else one
                for k, (one, its) in enumerate(zip(devices, served, strict=True))
            ]

    def where(self, key: Key) -> str:
        """File and line of a key, by the name that it has for a rotary axis."""
        return self._where(self._own.get(key, key))

    def spoken(self, faults: list[str]) -> list[str]:
        """The faults with the names and units that a linear axis has, of every axis that is one."""
        if not self._linear:
            return faults
        if all(self._linear):
            return [words(one, "linear") for one in faults]
        return [words(one, "linear") if self._tables.search(one) else one for one in faults]

    def _device(self, k: int, device: dict[str, Any], linear: list[bool]) -> dict[str, Any]:
        """A device with its options turned: all, if every axis that it serves is linear, else what is of a
        linear one alone."""
        options = device.get("options")
        if not isinstance(options, dict) or not any(linear):
            return device
        try:
            model = registry.options_model(str(device.get("kind")))
        except BackendError:
            return device  # told where it is looked up
        key = ("device", k, "options")
        if all(linear):
            return {**device, "options": self._table(options, model, key, key)}
        turned = dict(options)
        for field in model.model_fields.keys() & set(PER_AXIS):
            tables = options.get(field)
            if not isinstance(tables, list) or len(tables) != len(linear):
                continue  # one for all of them: of rad and N m
            # of an option that may be several tables the first: they have the same names of fields
            inner = next(_models(model.model_fields[field].annotation), None)
            turned[field] = [
                self._value(table, inner if its else None, (*key, field, i), (*key, field, i))
                for i, (table, its) in enumerate(zip(tables, linear, strict=True))
            ]
        return {**device, "options": turned}

    def _table(
        self, table: Mapping[str, Any], model: type[BaseModel], own: Key, turned: Key
    ) -> dict[str, Any]:
        known = {
            name(one, "linear"): one
            for one in model.model_fields
            # a table that has both names means both as they stand
            if name(one, "linear") not in model.model_fields
        }
        found: dict[str, Any] = {}
        for key, value in table.items():
            field = known.get(key, key)
            if key in known.values():  # the rotary name would be read in another unit than it says
                rotary = (*own, key)
                self.faults.append(
                    f"{self._where(rotary)}: {written(rotary)}: the axis is linear: write "
                    f"{name(key, 'linear')}"
                )
            # faults are found under the turned name, and told under the written one
            self._own[(*turned, field)] = (*own, key)
            inner = (
                next(_models(model.model_fields[field].annotation), None)
                if field in model.model_fields
                else None
            )
            found[field] = self._value(value, inner, (*own, key), (*turned, field))
        return found

    def _value(self, value: object, model: type[BaseModel] | None, own: Key, turned: Key) -> object:
        if model is None:
            return value
        if isinstance(value, dict):
            return self._table(value, model, own, turned)
        if isinstance(value, list):
            return [self._value(one, model, (*own, k), (*turned, k)) for k, one in enumerate(value)]
        return value


ENDS = ("position_min_rad", "position_max_rad")
"""Defaults that stand for none."""


def with_defaults(table: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """A table of a linear axis with what it leaves out, where that is a number of rad or N m: as it is at a
    handle (`HANDLE_M`)."""
    whole = dict(table)
    for key, field in model.model_fields.items():
        inner = next(_models(field.annotation), None)
        if inner is not None:
            within = whole.get(key, {})
            if isinstance(within, Mapping) and (made := with_defaults(within, inner)):
                whole[key] = made
        elif (
            key not in whole
            and isinstance(field.default, float)
            and key not in ENDS  # +-1000 is no travel of anything
            and at_handle(key) != 1.0  # a gain or a time is the same for both
        ):
            whole[key] = at_handle(key) * field.default
    return whole


def schema_of(schema: object, motion: str) -> object:
    """A JSON Schema of the rig file with the keys, texts and required names that axes of this motion have."""
    if motion != "linear":
        return schema
    if isinstance(schema, Mapping):
        return {
            key: {name(one, motion): schema_of(each, motion) for one, each in value.items()}
            if key == "properties"
            else [name(one, motion) for one in value]
            if key == "required"
            else schema_of(value, motion)
            for key, value in schema.items()
        }
    if isinstance(schema, list):
        return [schema_of(one, motion) for one in schema]
    return words(schema, motion) if isinstance(schema, str) else schema


def _of_linear_axes(axes: list[bool], devices: list[list[bool]]) -> re.Pattern[str]:
    """What a text that is about a linear axis has in it, of a rig of both: the name of a table, as `written`
    gives it.

    Given which axes are linear, and which of those that each device serves."""
    tables = [rf"(?<!options\.)axis\[{k}\]" for k, linear in enumerate(axes) if linear]
    for k, served in enumerate(devices):
        options = rf"device\[{k}\]\.options\b"
        if all(served):
            tables.append(options)
        else:
            tables += [
                rf"{options}\.(?:{'|'.join(PER_AXIS)})\[{i}\]" for i, linear in enumerate(served) if linear
            ]
    return re.compile("|".join(tables))


def _served(device: object, names: list[Any]) -> list[int]:
    """Axes of a device, by their numbers in the rig, in the order of its tables; a name that no axis has is
    told elsewhere."""
    own = device.get("axes") if isinstance(device, dict) else None
    return (
        [names.index(one) for one in own if one in names]
        if isinstance(own, list) and own
        else [*range(len(names))]
    )


def _list(value: object) -> list[Any]:
    return value if isinstance(value, list) else []


def _models(annotation: object) -> Iterator[type[BaseModel]]:
    """Models that a type is made of, in order."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)
