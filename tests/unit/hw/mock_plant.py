"""The simulated rig with some options, and a run of it; nothing of pytest."""

from hardware import rig

from hw.simulators.jit import records
from hw.simulators.mock_backend import MockBackend
from hw.simulators.mock_options import MockOptions
from rtctl.tick import new_ticks


def make(of=None, **options):
    return MockBackend(MockOptions.model_validate(options).model_dump(mode="json"), of or rig())


NOISY = {
    "force": {"noise_n": 0.01, "drift_n_sqrt_s": 0.01, "bias_n": [0.1, -0.2, 0.3]},
    "axis": [
        {
            "current_noise_a": 0.01,
            "ripple_nm": 0.01,
            "friction": {"modulation_share": 0.1, "scale_negative": 1.1, "model": "elasto_plastic"},
        }
    ],
    "hand": [{"kind": "sine", "start_s": 0.0, "inertia_kgm2": 0.002}],
}


def run(backend, currents_a, first=0, enabled=1):
    """One tick per current (one per axis or for all); the ticks."""
    tick = records(new_ticks(1, len(backend.state["position_rad"][0])))
    out = new_ticks(len(currents_a), len(backend.state["position_rad"][0]))
    for k, current_a in enumerate(currents_a):
        tick["tick"] = first + k
        backend.read(tick)
        tick["current_command_a"] = current_a
        tick["enabled"] = enabled
        backend.write(tick)
        out[k] = tick[0]
    return out
