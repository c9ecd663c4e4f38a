"""Any damage to a model file is refused; any regression compiles to itself."""

import json

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rtctl.errors import ModelError
from rtctl.friction import artefact
from rtctl.friction.kind_curve import Curve
from rtctl.friction.kind_spline import compile_spline
from rtctl.friction.learn.fit import fit_points
from rtctl.friction.points import FrictionPoints


@pytest.fixture(scope="module")
def raw(tmp_path_factory):
    v = np.concatenate([[0.0], np.geomspace(0.02, 2, 20)])
    rows = [(s * x, 0.25 + 0.1 * np.exp(-((x / 0.1) ** 2)) + 0.05 * x, s, 0, 1) for s in (1, -1) for x in v]
    path = tmp_path_factory.mktemp("model") / "m.json"
    artefact.save(fit_points(FrictionPoints.from_rows(rows, "p.csv", "0" * 64), rig="mock", c=100), path)
    return path, path.read_bytes()


def _refused(path, content):
    damaged = path.with_name("damaged.json")
    damaged.write_bytes(content)
    with pytest.raises(ModelError) as caught:
        artefact.load(damaged)
    assert "damaged.json" in str(caught.value)


@settings(max_examples=150, deadline=None)
@given(place=st.integers(0, 10**6), byte=st.integers(0, 255))
def test_any_changed_byte_is_refused(raw, place, byte):
    path, content = raw
    at = place % len(content)
    assume(content[at] != byte)
    _refused(path, content[:at] + bytes([byte]) + content[at + 1 :])


@settings(max_examples=60, deadline=None)
@given(place=st.integers(0, 10**6), bit=st.integers(0, 7))
def test_any_flipped_bit_of_a_digit_is_refused(raw, place, bit):
    path, content = raw
    digits = [i for i, c in enumerate(content) if chr(c).isdigit()]
    at = digits[place % len(digits)]
    _refused(path, content[:at] + bytes([content[at] ^ (1 << bit)]) + content[at + 1 :])


@settings(max_examples=40, deadline=None)
@given(share=st.floats(0, 1, exclude_max=True))
def test_any_truncation_is_refused(raw, share):
    path, content = raw
    _refused(path, content[: int(share * len(content))])


@settings(max_examples=20, deadline=None)
@given(tail=st.binary(min_size=1, max_size=8))
def test_anything_appended_is_refused(raw, tail):
    path, content = raw
    _refused(path, content + tail)


def _places(node, path=()):
    if isinstance(node, dict | list):
        for key, value in node.items() if isinstance(node, dict) else enumerate(node):
            yield (*path, key)
            yield from _places(value, (*path, key))


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_any_key_or_element_taken_out_is_refused(raw, data):
    path, content = raw
    document = json.loads(content)
    *parents, last = data.draw(st.sampled_from(list(_places(document))))
    node = document
    for key in parents:
        node = node[key]
    del node[last]
    _refused(path, json.dumps(document).encode())


@settings(max_examples=60, deadline=None)
@given(
    vectors=st.lists(st.floats(0, 10), min_size=1, max_size=30),
    seed=st.integers(0, 2**32 - 1),
    intercept=st.floats(-1, 1),
)
def test_any_regression_compiles_to_the_same_function(vectors, seed, intercept):
    v = np.array(vectors)
    beta = np.random.default_rng(seed).uniform(-100, 100, len(v))
    beta -= beta.mean()  # the optimum has sum(beta) = 0, which makes the tail linear
    curve = compile_spline(v, beta, intercept)
    speed = np.union1d(np.linspace(0, 12, 500), v)
    source = Curve("spline", {}, v, beta, intercept)
    error = np.abs(curve(speed) - source(speed)).max()
    assert error <= 4 * source.rounding(12.0)
    assert (np.diff(curve.knots) > 0).all()
