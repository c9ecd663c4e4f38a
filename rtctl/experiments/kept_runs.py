"""What a positioning experiment on a rig keeps on disk, so that a fault or Ctrl-C costs one case, not all.

`kept.npz` in the folder of the report while it goes on, packed as `runs.npz` beside the report once that is
written; an experiment that is resumed begins with either, and has nothing left to do with the second:

about                       JSON: what the rest belongs to
model/NAME/...              friction models compared: their record, held-out error (N m) and terms
CONTROLLER/CASE/MODEL/...   runs: reference (rad, rad/s, rad/s^2), position (rad), torque (N m)"""

from __future__ import annotations

import contextlib
import io
import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from hw.outside import json_of, opened, shown
from rtctl.bounded_npz import read_arrays
from rtctl.control.records import MODEL
from rtctl.errors import ConfigError, DataError
from rtctl.experiments.models import Compared
from rtctl.experiments.positioning import Followed
from rtctl.whole_files import write_together

NAME, REPORTED = "kept.npz", "runs.npz"
MOST_BYTES = 1 << 31
"""Largest size of all kept runs, unpacked: those of the longest experiment with every model on the quickest
loop have .57 of it."""

Key = tuple[str, str, str]
"""controller, case, model"""
Runs = dict[Key, Followed]

_ABOUT, _MODEL = "about", "model"


class KeptRuns:
    """The runs of one experiment in one folder.

    Parameters
    ----------
    folder
        Of the report.
    about
        What the runs belong to, by name; what is kept of anything else is refused.
    resume
        Go on with what is there; False refuses to begin on top of it.

    Attributes
    ----------
    models
        The models compared, in order, as an earlier start learned them; empty where there was none.

    Raises
    ------
    ConfigError
        Runs of an earlier start are there, and `resume` is False.
    DataError
        They cannot be read, or belong to something else."""

    def __init__(self, folder: Path, about: Mapping[str, str], *, resume: bool) -> None:
        self.path, self._about = folder / NAME, dict(about)
        self.models: list[Compared] = []
        self.runs: Runs = {}
        there = self.path
        if not there.exists():
            there = folder / REPORTED
            if not (resume and there.exists()):
                return
        elif not resume:
            raise ConfigError(
                f"{self.path}: runs of an earlier start are kept there; give --resume to go on with them, "
                "or choose another --out"
            )
        found, self.models, self.runs = _read(there)
        for name, value in self._about.items():
            if found.get(name) != value:  # figures of two rigs, or two sets of points, are no comparison
                raise DataError(
                    f"{there}: was measured with another {name} ({found.get(name)}); go back to that, "
                    "or choose another --out"
                )

    def add(self, runs: Runs) -> None:
        """Keep the models and more runs, at once on disk. Raises DataError when they cannot be written."""
        self.runs |= runs
        # all of them again: an npz cannot be added to without a moment in which it is broken
        # at once: a fault costs one session
        write_together(self.path.parent, {NAME: self.packed()})

    def packed(self, *, small: bool = False) -> bytes:
        """The file; `small`: compressed, which takes longer than a rig should wait between sessions."""
        arrays = {_ABOUT: np.frombuffer(json.dumps(self._about).encode(), np.uint8)}
        for one in self.models:
            # JSON has no NaN
            about = json.dumps([one.rmse_nm if np.isfinite(one.rmse_nm) else None, one.terms])
            arrays[f"{_MODEL}/{one.name}/about"] = np.frombuffer(about.encode(), np.uint8)
            arrays[f"{_MODEL}/{one.name}/record"] = np.frombuffer(one.record.tobytes(), np.uint8)
        for key, run in self.runs.items():
            name = "/".join(key)
            arrays[f"{name}/reference"] = run.reference
            arrays[f"{name}/position_rad"], arrays[f"{name}/torque_nm"] = run.position_rad, run.torque_nm
        packed = io.BytesIO()
        (np.savez_compressed if small else np.savez)(packed, allow_pickle=False, **arrays)
        return packed.getvalue()

    def remove(self) -> None:
        """Take it away: the report has the runs now."""
        # the report is on disk: a file too many is no reason to fail
        with contextlib.suppress(OSError):
            self.path.unlink(missing_ok=True)


def _read(path: Path) -> tuple[dict[str, str], list[Compared], Runs]:
    # a file may have been cut off by a full disk, or be somebody else's: whatever it holds it is named
    try:
        with opened(path) as raw:
            file = read_arrays(raw, MOST_BYTES)
        about = dict(json_of(bytes(file[_ABOUT])))
        # a dict keeps their order, which is that of the comparison
        keys = dict.fromkeys(name.rsplit("/", 1)[0] for name in file if name != _ABOUT)
        models = [_model(file, key) for key in keys if key.startswith(f"{_MODEL}/")]
        runs = {_key(key): _run(file, key) for key in keys if not key.startswith(f"{_MODEL}/")}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(
            f"{path}: not runs that rtctl kept ({shown(error)}); remove it and start anew"
        ) from error
    return about, models, runs


def _model(file: Mapping[str, np.ndarray], key: str) -> Compared:
    rmse_nm, terms = json.loads(bytes(file[f"{key}/about"]))
    record = np.frombuffer(bytes(file[f"{key}/record"]), MODEL).copy()
    name = key.removeprefix(f"{_MODEL}/")
    return Compared(name, record, float("nan") if rmse_nm is None else rmse_nm, terms)


def _key(text: str) -> Key:
    controller, rest = text.split("/", 1)
    case, model = rest.rsplit("/", 1)  # a case may have a slash in its unit (rad/s)
    return controller, case, model


def _run(file: Mapping[str, np.ndarray], key: str) -> Followed:
    return Followed(file[f"{key}/position_rad"], file[f"{key}/torque_nm"], file[f"{key}/reference"])
