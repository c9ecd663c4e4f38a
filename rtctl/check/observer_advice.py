"""The disturbance observer that a rig file should ask for beside a new friction model: what it says where
that passes, else a slower one, else none."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rtctl.check import stability_report
from rtctl.check.verdict import Outcome

if TYPE_CHECKING:
    from rtctl.friction.gain import AxisGain
    from rtctl.rig_file.config import LoadedConfig
    from rtctl.rig_file.friction_tables import ObserverTable

SHARES = (1.0, 0.5, 0.25, 0.125)
"""Bandwidths that are tried, of what the rig file says or leaves open: with less an observer helps nobody."""
WHERE = ".friction.observer"
"""Stands in each line by which `rtctl check` refuses an observer."""


def snippet(loaded: LoadedConfig, axis: AxisGain, model: Path) -> str:
    """Lines for the rig file beside those of the feed-forward; "" where the file's own observer passes with
    this model.

    Raises
    ------
    ModelError
        The model cannot be believed, or is of another rig."""
    index = next(i for i, table in enumerate(loaded.config.axis) if table.name == axis.axis)
    usual = loaded.config.axis[index].friction.observer
    usual_hz = usual.bandwidth_at(loaded.config.loop.rate_hz)
    # the quickest that passes helps most, so the first one is the advice
    for share in SHARES:
        # judged as it will be printed
        hz = float(f"{share * usual_hz:.2g}")
        slower = usual if share == 1.0 else usual.model_copy(update={"bandwidth_hz": hz})
        if _passes(loaded, index, axis, model, slower):
            line = f"bandwidth_hz = {hz:g}".ljust(36) + f"# at {usual_hz:g} rtctl check refuses it"
            # what the file says already is no advice
            return "" if share == 1.0 else f"\n[axis.friction.observer]\n{line}"
    return "\n[axis.friction.observer]\n" + "gain = 0".ljust(36) + "# rtctl check refuses slower ones, too"


def _passes(loaded: LoadedConfig, index: int, axis: AxisGain, model: Path, observer: ObserverTable) -> bool:
    """Whether `rtctl check` has nothing against this observer beside the feed-forward that is recommended."""
    table = loaded.config.axis[index]
    told = {"model": str(model.resolve()), "gain": axis.start_gain, "cap_share": axis.start_cap_share}
    friction = table.friction.model_copy(update={**told, "observer": observer})
    axes = list(loaded.config.axis)
    axes[index] = table.model_copy(update={"friction": friction})
    config = loaded.config.model_copy(update={"axis": tuple(axes)})
    # this axis alone: of several the models are learned one after the other
    with_it = loaded.model_copy(update={"config": config})
    report = stability_report.examine_axis(with_it, index, None, telling=False)
    return not any(row.outcome == Outcome.FAIL and WHERE in row.refusal for row in report.verdicts)
