"""What a balance leaves over that is no noise bounds what it moved; a torque is taken as of the instants that
it was measured at.
"""

from dataclasses import replace

import numpy as np
import pytest
from moved_joint import CLEAN, simulate

from rtctl.friction.logs.balance import Balance
from rtctl.friction.logs.left_over import bounds, no_noise, told
from rtctl.friction.logs.log_input import Gearing, options_of, read_log
from rtctl.friction.logs.regression import joint_fit, taken_late
from rtctl.friction.logs.regressors import of_stretches


def signals_of(log, folder, delay_s=None):
    path = folder / "log.csv"
    np.savetxt(
        path,
        np.column_stack([log.time, log.position, log.motor]),
        delimiter=",",
        header="time_s,x,motor",
        comments="",
    )
    mapped = {"position": {"column": "x"}, "motor_torque": {"column": "motor"}}
    return of_stretches(read_log(options_of(path, mapped, None), Gearing(), delay_s))


def test_a_command_that_is_held_is_put_back_and_a_current_of_the_same_instant_is_not(tmp_path):
    held = simulate(replace(CLEAN["motor"], rate_hz=100.0))  # its motor torque is what was held until the row
    signals = signals_of(held, tmp_path)
    assert taken_late(signals, 0.005) == 0.005
    # as if measured at the row
    together = replace(held, motor=np.interp(held.time + 0.005, held.time, held.motor), time=held.time)
    early = signals_of(together, tmp_path)
    assert taken_late(early, 0.005) == 0
    found = joint_fit(signals_of(together, tmp_path, 0.0)).symmetric.parameters
    assert found["inertia_kgm2"].value == pytest.approx(held.truth["inertia_kgm2"], rel=0.03)


def test_noise_is_not_smooth_and_what_is_smooth_bounds_what_it_moved(tmp_path):
    noisy = signals_of(simulate(CLEAN["motor, 1 kHz"]), tmp_path)
    assert no_noise(Balance.of(noisy)) == 0
    assert told(Balance.of(noisy), 0.0) == ()
    log = simulate(replace(CLEAN["motor"], hand=(10.0, 0.3)))
    balance = Balance.of(signals_of(log, tmp_path))
    rest = no_noise(balance)
    assert rest == pytest.approx(balance.fit().rest, rel=0.1)
    off = 1 - balance.fit().inertia / log.truth["inertia_kgm2"]
    assert 0.12 < off < 1.1 * bounds(balance, rest)["inertia"]
    (text,) = told(balance, 0.0)
    assert "inertia by" in text
