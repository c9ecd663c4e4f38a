"""What a run on a rig keeps when it ends early, and what it refuses to go on with."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rtctl.control.records import MODEL
from rtctl.errors import ConfigError, DataError
from rtctl.experiments import kept_runs, tracking
from rtctl.experiments.kept_runs import KeptRuns
from rtctl.experiments.models import COMPARED, Compared
from rtctl.experiments.positioning import CONTROLLERS, Followed
from rtctl.rig_file.config import load
from rtctl.rig_file.rig_tables import LoopTable

CONFIGS = Path(__file__).parents[3] / "configs"

ABOUT = {"experiment": "tracking", "rig file (sha256)": "abc"}
MODELS = [
    Compared("none", np.zeros(1, MODEL), float("nan"), "-"),
    Compared("epsilon-SVR, spline", np.ones(1, MODEL), 0.25, "9 + 10"),
]
KEY = ("PID", "triangle 0.02 rad/s", "epsilon-SVR, spline")


def followed(n):
    return Followed(np.arange(n) + 0.1, np.arange(n) + 0.2, np.arange(3.0 * n).reshape(n, 3))


def kept(folder):
    made = KeptRuns(folder, ABOUT, resume=True)
    made.models = list(MODELS)
    made.add({KEY: followed(4)})
    return made


def test_runs_and_models_come_back_as_they_were(tmp_path):
    kept(tmp_path).add({("PD", "step 10 mrad", "none"): followed(2)})
    again = KeptRuns(tmp_path, ABOUT, resume=True)
    assert set(again.runs) == {KEY, ("PD", "step 10 mrad", "none")}
    assert again.runs[KEY].position_rad.tolist() == followed(4).position_rad.tolist()
    assert again.runs[KEY].torque_nm.tolist() == followed(4).torque_nm.tolist()
    assert again.runs[KEY].reference.tolist() == followed(4).reference.tolist()
    assert [one.name for one in again.models] == [one.name for one in MODELS]
    assert again.models[1].record.tobytes() == MODELS[1].record.tobytes()
    assert (again.models[1].rmse_nm, again.models[1].terms) == (0.25, "9 + 10")
    assert np.isnan(again.models[0].rmse_nm)


def test_a_new_start_does_not_begin_on_top_of_what_is_kept(tmp_path):
    kept(tmp_path)
    with pytest.raises(ConfigError, match="--resume"):
        KeptRuns(tmp_path, ABOUT, resume=False)


def test_runs_of_another_rig_file_are_refused_by_name(tmp_path):
    kept(tmp_path)
    with pytest.raises(DataError, match="rig file"):
        KeptRuns(tmp_path, {**ABOUT, "rig file (sha256)": "other"}, resume=True)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_damaged_file_is_refused(tmp_path, share):
    path = kept(tmp_path).path
    data = path.read_bytes()
    path.write_bytes(data[: round(share * len(data))])
    with pytest.raises(DataError, match="start anew"):
        KeptRuns(tmp_path, ABOUT, resume=True)


def test_a_file_of_somebody_else_is_refused(tmp_path):
    np.savez(tmp_path / "kept.npz", about=np.frombuffer(b"[1]", np.uint8))
    with pytest.raises(DataError, match="not runs that rtctl kept"):
        KeptRuns(tmp_path, ABOUT, resume=True)


def test_what_is_reported_is_not_kept(tmp_path):
    made = kept(tmp_path)
    made.remove()
    assert not list(tmp_path.iterdir())


def test_what_was_reported_is_where_a_start_with_resume_begins_and_another_one_does_not(tmp_path):
    (tmp_path / kept_runs.REPORTED).write_bytes(kept(tmp_path).packed(small=True))
    (tmp_path / kept_runs.NAME).unlink()
    again = KeptRuns(tmp_path, ABOUT, resume=True)
    assert again.runs[KEY].reference.tolist() == followed(4).reference.tolist()
    assert again.models[1].record.tobytes() == MODELS[1].record.tobytes()
    with pytest.raises(DataError, match=r"runs\.npz: was measured with another rig file"):
        KeptRuns(tmp_path, {**ABOUT, "rig file (sha256)": "other"}, resume=True)
    assert KeptRuns(tmp_path, ABOUT, resume=False).runs == {}


def test_what_the_longest_experiment_keeps_on_the_quickest_loop_can_be_read_again():
    quickest_hz = next(one.le for one in LoopTable.model_fields["rate_hz"].metadata if hasattr(one, "le"))
    loaded = load(CONFIGS / "mock.toml")
    order = SimpleNamespace(loaded=loaded, simulate=False, motion="rotary")
    ticks = sum(len(case.reference) for case in tracking.cases_of(order))
    ticks *= quickest_hz / loaded.config.loop.rate_hz
    each = 8 * (3 + 1 + 1)  # reference of three, angle and torque
    size = ticks * each * len(CONTROLLERS) * len(COMPARED)
    assert 0.5 * kept_runs.MOST_BYTES < size < 0.7 * kept_runs.MOST_BYTES
