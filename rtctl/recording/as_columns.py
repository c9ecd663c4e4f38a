"""A recording of rtctl as a log: its tick fields as columns for identification, fit and playback."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from hw.interface import BackendError
from hw.member import Member
from hw.playback.columns import READERS
from rtctl.errors import DataError, RtctlError
from rtctl.recording.export import columns, times
from rtctl.recording.joint_states import read_joint_states
from rtctl.recording.reader import RecordingReader, all_parts
from rtctl.recording.tick_cdr import RECORDED


def register() -> None:
    """Let logs be `.mcap` files wherever logs are read."""
    # here, not in `hw`: a loop that plays back no recording loads nothing of this
    READERS[".mcap"] = read


def log_readers(members: Sequence[Member]) -> list[str]:
    """Modules that teach a loop process to read the logs that these devices play back: this one for a
    recording, else none.

    They are named only where a recording is played, so that no other loop loads them."""
    played = [member.options.get("file", "") for member in members if member.kind == "playback"]
    return [__name__] if any(str(file).endswith(".mcap") for file in played) else []


def read(path: Path, names: tuple[str, ...] = ()) -> Mapping[str, np.ndarray]:
    """Columns of a recording over all its parts, (n,) each, by the names that `rtctl export` gives them.

    Besides `wall_ns` (since 1970) and `time_s`, from the first tick on (missed ticks are missing rows); with
    one axis a field goes by its own name, too.

    Raises
    ------
    BackendError
        Not a recording, and no bag of ROS 2 with joint states."""
    try:
        # all parts, whichever is named: a file ends by the hour, a motion does not
        reader = RecordingReader(all_parts(path))
        rows = reader.read().rows
    except RtctlError as error:
        return _of_others(path, str(error), names)
    found = columns(rows, [field.name for field in RECORDED], reader.axes, reader.motions)
    if reader.n_axes == 1:
        alone = f".{reader.axes[0]}"
        # of one axis nobody has to know the name
        found |= {name.removesuffix(alone): column for name, column in found.items() if name.endswith(alone)}
    # sum of at most one: 0 for a recording without a tick
    return found | times(rows, int(reader.about["start_wall_ns"]), int(rows["time_ns"][:1].sum()))


def _of_others(path: Path, why: str, names: tuple[str, ...]) -> Mapping[str, np.ndarray]:
    """Columns of a bag, those of `names` among them; `why` it is no recording of rtctl."""
    try:
        return read_joint_states(path, names)
    except DataError as error:
        raise BackendError(f"{why}; {str(error).removeprefix(f'{path}: ')}") from error
