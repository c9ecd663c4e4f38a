"""What is asked of an experiment, and how it says how far it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rtctl.errors import ConfigError
from rtctl.rig_file.config import LoadedConfig

Progress = Callable[[float, str], None]
"""Receives the share done, 0 to 1, and what is being done."""

SEEDS = 10


def silent(_share: float, _text: str) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True)
class Order:
    """A rig, and how thoroughly: `seeds` runs of everything, on the simulated rig or the real loop.

    `points`: measured friction points for the experiments that compare models; None: those beside the rig's
    model, else measured on the simulated rig. `seconds`: of one measurement on the real loop."""

    loaded: LoadedConfig
    seeds: int = SEEDS
    simulate: bool = True
    points: Path | None = None
    seconds: float = 12.0
    runtime_dir: str | None = None
    progress: Progress = silent
    announce: Callable[[str], None] = lambda _text: None
    models: tuple[str, ...] = ()
    """Friction models to compare besides none; empty: all."""
    cases: tuple[str, ...] = ()
    """Steps or references to run, by name; empty: all."""
    out: Path = Path()
    """Folder of the report; long runs on a rig keep there what they have measured."""
    resume: bool = False
    """Go on with what an earlier start kept in `out`."""
    plant: str = ""
    """Plant of the mock's family that stands in the rig file's place; empty: the rig file's own."""

    @property
    def motion(self) -> str:
        """Motion of the first axis, "rotary" or "linear"."""
        return self.loaded.config.axis[0].motion

    @property
    def repetitions(self) -> int:
        """Runs of everything."""
        return self.seeds if self.simulate else 1

    @property
    def shown_run(self) -> str:
        """Which of the runs a picture shows."""
        return "Seed 0." if self.simulate else "The run on the rig."

    def require_simulated(self, name: str) -> None:
        """Refuse what only the simulated rig can do. Raises ConfigError."""
        # the mock alone: beside a real force sensor its joint would be moved by nobody's hand
        kinds = [device.kind for device in self.loaded.config.device]
        if kinds != ["mock"]:
            raise ConfigError(
                f"{self.loaded.path}: device[0].kind: {name} moves the joint by hands and controllers that "
                f"only the simulated rig ('mock', alone) has, not {', '.join(kinds)}; run free-motion or "
                "spring on this rig, or give a rig file of kind mock"
            )

    def part(self, low: float, high: float, before: str = "") -> Progress:
        """Progress of a step that covers this share of the whole; `before` goes before its words."""
        return lambda share, text: self.progress(low + (high - low) * share, before + text)
