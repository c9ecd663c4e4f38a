"""The watched friction over a recording: what a host would have said of it, and when."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np

from rtctl.control.vocabulary import PlaceUse
from rtctl.errors import DataError
from rtctl.friction.drift_estimate import Estimate
from rtctl.friction.drift_watch import AxisWatch, RigWatch
from rtctl.rig_file.friction_tables import DriftTable

STEP_S = 10.0
"""From one entry of the history to the next."""


_TAKEN = {"params.force_used", "params.presliding_rad"}
"""What of the law's arrays has no value to go on with where a recording lacks it."""


def over_ticks(
    params: np.ndarray,
    model: np.ndarray,
    names: Sequence[str],
    batches: Iterable[np.ndarray],
    table: DriftTable,
    missing: Collection[str] = (),
) -> list[dict[str, Any]]:
    """Watch a whole recording; one map for each axis that can be watched.

    Parameters
    ----------
    params, model
        The law's arrays, as recorded.
    names
        Of the axes.
    batches
        Ticks, in order.
    missing
        Fields of a tick, and of the law's arrays, that are not in the recording. Where it does not say which
        places were trusted, those that were given were.

    Returns
    -------
    list of dict
        `axis`, what `as_told` gives of the end, `warning` and `stop` (words, or empty), and `history`:
        `time_s` since the first tick, and the same again, every `STEP_S` of the recording in which something
        new was seen.

    Raises
    ------
    DataError
        No axis can be watched: no friction model, or no force sensor; or an earlier version that recorded it
        did not say what that takes."""
    if untold := sorted(_TAKEN.intersection(missing)):
        raise DataError(
            f"recorded by an earlier version of rtctl, whose law did not say {', '.join(untold)}: nothing to "
            "compare its friction with; record anew with this version"
        )
    # the same watch as the host's: what is told of a recording is what would have been told then
    watch = RigWatch(params, model, [table] * len(names))
    watched = [(name, axis) for name, axis in zip(names, watch.axes, strict=True) if axis is not None]
    if not watched:
        raise DataError(
            "no axis of this recording has a friction model and a force sensor: there is nothing to compare; "
            "give a recording of a rig that has both"
        )
    history: dict[str, list[dict[str, Any]]] = {name: [] for name, _ in watched}
    seen: dict[str, Estimate | None] = {name: None for name, _ in watched}
    first_s, next_s = None, STEP_S
    for rows in batches:
        if not len(rows):
            continue
        if "place_trust" in missing:
            rows["place_trust"] = params["place_kind"] == PlaceUse.GIVEN
        watch.follow(rows)
        now_s = int(rows["time_ns"][-1]) * 1e-9
        first_s = now_s if first_s is None else first_s
        if now_s - first_s < next_s:
            continue
        # from now on, and not from when it was due: after a pause of the recording there is one entry and not
        # many
        next_s = now_s - first_s + STEP_S
        for name, axis in watched:
            # a history of what stands still would look like one that was measured again and again
            if axis.found is not None and axis.found is not seen[name]:
                seen[name] = axis.found
                history[name].append({"time_s": now_s - first_s, **told(axis)})
    # the last block is shorter than those that are looked at as they come
    watch.look()
    return [
        {"axis": name, **told(axis), "warning": axis.warning, "stop": axis.stopped, "history": history[name]}
        for name, axis in watched
    ]


def told(axis: AxisWatch) -> dict[str, Any]:
    """What is known of an axis, for telemetry and reports: numbers with their intervals, None where nothing
    is.

    Intervals are two standard errors wide on either side, what the method may err by included."""
    found = axis.found
    if found is None:
        return {
            "factor": None,
            "seconds": axis.strokes.rows / axis.rate_hz,
            "strokes": len(axis.strokes.table),
        }
    pairs = {
        "factor": (found.factor, found.factor_error),
        "forward": (found.forward, found.forward_error),
        "backward": (found.backward, found.backward_error),
        "offset_nm": (found.offset_nm, found.offset_error_nm),
    }
    return {
        **{
            name: {"value": value, "low": value - 2.0 * error, "high": value + 2.0 * error}
            for name, (value, error) in pairs.items()
        },
        "seconds": found.seconds,
        "strokes": found.strokes,
        "place_trust": found.place_trust,
    }
