"""Friction evaluation: inside compiled code, called from Python, scikit-learn, onnxruntime, in turn."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rtctl.control.friction_curve import friction_magnitude
from rtctl.control.jit import compiled
from rtctl.friction import artefact
from tests.bench.row import Row

ROUNDS = 5


@compiled
def _sum(model: np.ndarray, velocities_rad_s: np.ndarray) -> float:
    total = 0.0
    record = model[0]
    for velocity in velocities_rad_s:
        total += friction_magnitude(record, velocity)
    return total


@compiled
def _one(model: np.ndarray, velocity_rad_s: float) -> float:
    return friction_magnitude(model[0], velocity_rad_s)


def _seconds(call: Callable[[], object]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def rows(model_path: Path) -> list[Row]:
    """Time per evaluation, in nanoseconds inside compiled code and microseconds from Python; speed-ups.

    scikit-learn predicts with an RBF epsilon-SVR (its fastest path: no Python kernel) fitted to the same
    curve, one value per call, as a loop would need it; onnxruntime runs the same SVR converted by skl2onnx.
    """
    from sklearn.svm import SVR

    model = artefact.load(model_path)
    record = model.record()
    rng = np.random.default_rng(1)
    many = rng.uniform(-2.0, 2.0, 200_000)
    few = rng.uniform(-2.0, 2.0, 20_000).tolist()
    speeds = np.linspace(0.005, 2.0, 54)
    svr = SVR(kernel="rbf", gamma=5.0, C=10.0, epsilon=0.005).fit(speeds[:, None], model.magnitude(speeds))
    inputs = [np.array([[abs(v)]]) for v in few[:300]]
    onnx = _onnx_call(svr)
    _sum(record, many), _one(record, 0.1), onnx(inputs[0])
    inside, single, sklearn, ort = (np.empty(ROUNDS) for _ in range(4))
    for i in range(ROUNDS):
        inside[i] = _seconds(lambda: _sum(record, many)) / len(many)
        single[i] = _seconds(lambda: [_one(record, v) for v in few]) / len(few)
        sklearn[i] = _seconds(lambda: [svr.predict(x) for x in inputs]) / len(inputs)
        ort[i] = _seconds(lambda: [onnx(x) for x in inputs]) / len(inputs)
    ns, us = 1e9 * float(np.median(inside)), 1e6 * float(np.median(single))
    skl_us, ort_us = 1e6 * float(np.median(sklearn)), 1e6 * float(np.median(ort))
    n_sv = len(svr.support_)
    return [
        Row("friction, inside the law", ns, "ns", "random velocities, both directions", 10.0),
        Row("friction, one call from Python", us, "us", "same model", 0.5),
        Row(
            "friction, faster than scikit-learn",
            skl_us / us,
            "x",
            f"SVR.predict, {n_sv} SVs: {skl_us:.3g} us",
            100.0,
            ">=",
        ),
        Row(
            "friction, faster than onnxruntime",
            ort_us / us,
            "x",
            f"same SVR in ONNX: {ort_us:.3g} us",
            5.0,
            ">=",
        ),
    ]


def _onnx_call(svr: object) -> Callable[[np.ndarray], object]:
    """One prediction by onnxruntime; NaN-marked rows if the bench extra is not installed are not invented."""
    import onnxruntime
    from skl2onnx import convert_sklearn
    from skl2onnx.common.data_types import FloatTensorType

    graph = convert_sklearn(svr, initial_types=[("x", FloatTensorType([None, 1]))])
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(
        graph.SerializeToString(), options, providers=["CPUExecutionProvider"]
    )
    return lambda x: session.run(None, {"x": x.astype(np.float32)})
