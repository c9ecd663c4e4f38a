"""The options of the devices of a rig file, checked by the models of their backends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from hw import registry
from hw.interface import BackendError
from hw.plain_words import Key
from rtctl.rig_file.mistakes import fault_lines, no_files
from rtctl.rig_file.rig_tables import DeviceTable, LoopTable


def device_options(
    path: Path, data: dict[str, Any], where: Callable[[Key], str]
) -> tuple[list[dict[str, Any]], list[str]]:
    """Validate every device's options against its backend's own model."""
    devices = data.get("device")
    valid: list[dict[str, Any]] = []
    faults: list[str] = []
    for i, device in enumerate(devices if isinstance(devices, list) else []):
        kind = device.get("kind") if isinstance(device, dict) else None
        if not isinstance(kind, str):
            continue  # the table's own fault
        faults += no_files(where, ("device", i, "options"), path.parent, device)
        try:
            model = registry.options_model(kind)
            context = {"folder": path.parent, **_facts(data, device)}
            options = model.model_validate(device.get("options", {}), context=context)
        except ValidationError as error:
            key = ("device", i, "options")
            faults += fault_lines(where, key, error, model, device.get("options", {}))
        except BackendError as error:
            faults.append(f"{where(('device', i, 'kind'))}: device[{i}].kind: {error}")
        else:
            valid.append(options.model_dump(mode="json"))
    return valid, faults


def _facts(data: dict[str, Any], device: dict[str, Any]) -> dict[str, Any]:
    """What a device's options may be checked against, as far as the rig file has it."""
    facts: dict[str, Any] = {}
    axes = device.get("axes") or data.get("axis")
    if isinstance(axes, list):
        facts["n_axes"] = len(axes)
    own_hz = device.get("rate_hz")  # raw values: the tables may be at fault themselves
    if isinstance(own_hz, int | float) and own_hz > 0:
        facts["device_rate_hz"] = float(own_hz)
    loop = data.get("loop", {})
    if isinstance(loop, dict):
        facts["clock"] = loop.get("clock")
        # what the loop will have where the file says nothing
        rate_hz = loop.get("rate_hz", LoopTable().rate_hz)
        if isinstance(rate_hz, int | float) and rate_hz > 0:
            facts["rate_hz"] = float(rate_hz)
    return facts


def put_script(path: Path, devices: Sequence[DeviceTable], data: dict[str, Any], script: Path) -> list[str]:
    """Write the schedule into the options of the one device that takes one; or say why not."""
    takers = []
    for i, device in enumerate(devices):
        try:
            simulated = registry.lookup(device.kind).simulated
            takes = "faults" in registry.options_model(device.kind).model_fields
        except BackendError:
            return []  # told where its options are checked
        if not simulated:
            return [
                f"{path}: device[{i}].kind: {device.kind!r} is no simulation: no faults are scripted into "
                "this rig"
            ]
        takers += [i] if takes else []
    # of two simulations nothing says whose faults they are
    if len(takers) != 1:
        remedy = "name the schedule in the options of one" if takers else "use a mock"
        return [f"{path}: device: {len(takers)} devices take scripted faults; {remedy}"]
    table = data["device"][takers[0]]
    table["options"] = {**table.get("options", {}), "faults": str(script)}
    return []
