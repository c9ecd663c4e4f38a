"""What a recording says beside its ticks: rig, versions, rig file, friction models, the law's arrays."""

from __future__ import annotations

import hashlib
import json
import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np

import hw
import rtctl.control
from hw.jit import source_key
from rtctl import __version__
from rtctl.check.law_plan import Plan
from rtctl.recording.law_arrays import LAW_NAME, LawArrays, pack_law, unpack_law
from rtctl.rig_file.config import LoadedConfig
from rtctl.wire.protocol import schema_sha256

RIG_NAME = "rig.toml"


def law_key() -> str:
    """Fingerprint of the control law's sources, byte by byte, and its compiler: equal keys replay bit for
    bit.

    Stricter than the key of compiled code: a recording is evidence, and to be read beside the sources it was
    made with."""
    control = Path(rtctl.control.__file__).parent
    return source_key(control, Path(hw.__file__).parent)


@dataclass(frozen=True)
class Setup:
    """Facts as texts, and attachments: name -> (media type, content)."""

    about: Mapping[str, str]
    attachments: Mapping[str, tuple[str, bytes]]

    @property
    def n_axes(self) -> int:
        """Number of axes."""
        return int(self.about["n_axes"])

    def with_state(self, state: np.ndarray) -> Setup:
        """A copy of this setup with the law's state before the first tick.

        A setup without the law's arrays is returned as it is."""
        # of a daemon of another version, over the wire: what it has is recorded all the same
        if LAW_NAME not in self.attachments:
            return self
        media, data = self.attachments[LAW_NAME]
        law = unpack_law(data, self.n_axes)
        packed = pack_law(LawArrays(law.params, law.model, law.command, state))
        return Setup(self.about, {**self.attachments, LAW_NAME: (media, packed)})

    def packed(self) -> dict[str, Any]:
        """As a map for telemetry."""
        files = {name: [media, data] for name, (media, data) in self.attachments.items()}
        return {"about": dict(self.about), "attachments": files}

    @classmethod
    def unpacked(cls, message: Mapping[str, Any]) -> Setup:
        """From the map of `packed`."""
        files = {name: (media, data) for name, (media, data) in message["attachments"].items()}
        return cls(message["about"], files)


def setup_of(
    loaded: LoadedConfig,
    plan: Plan,
    session: int,
    start_wall_ns: int,
    realtime: Sequence[Mapping[str, Any]] = (),
) -> Setup:
    """Gather everything a reader, or a replay years later, needs to know of a run."""
    config = loaded.config
    # a right that does not say is one that was given
    refused = [grant for grant in realtime if not grant.get("granted", True)]
    about = {
        "rig": config.rig.name,
        "version": __version__,
        "session": str(session),  # all facts are texts in MCAP
        "n_axes": str(plan.n_axes),
        "axes": json.dumps([axis.name for axis in config.axis]),
        "motion": json.dumps([axis.motion for axis in config.axis]),
        "rate_hz": repr(config.loop.rate_hz),
        "period_ns": str(plan.period_ns),
        "virtual_clock": str(config.loop.clock == "virtual").lower(),
        "simulated": str(config.simulated).lower(),
        "start_wall_ns": str(start_wall_ns),
        # beside the start of the clock: that may be of days ago, and names of files go by this one
        "began_wall_ns": str(time.time_ns()),
        "config_file": loaded.path.name,
        "config_sha256": loaded.sha256,
        "schema_sha256": schema_sha256(plan.n_axes, [axis.motion for axis in config.axis]),
        "law_key": law_key(),
        # as texts: a map of MCAP has no others
        "realtime": json.dumps(list(realtime)),
        "realtime_waivers": json.dumps([grant.get("right", "") for grant in refused]),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "platform": platform.platform(),
    }
    # without a state: at the first tick of a run it is zero
    law = LawArrays(plan.params, plan.model, plan.command)
    files: dict[str, tuple[str, bytes]] = {LAW_NAME: ("application/zip", pack_law(law))}
    # a rig that was made by a program has no file
    if loaded.path.is_file() and loaded.path.suffix == ".toml":
        text = loaded.path.read_bytes()
        # a first start compiles for minutes: a file that was edited meanwhile is not what runs
        if hashlib.sha256(text).hexdigest() == loaded.sha256:
            files[RIG_NAME] = ("application/toml", text)
    for axis, content in zip(config.axis, plan.model_files, strict=True):
        # not what the file holds by now: it is replaced while the rig runs, and before its first tick
        if content:
            files[f"model-{axis.name}.json"] = ("application/json", content)
    return Setup(about, files)
