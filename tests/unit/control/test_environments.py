"""The table of environments: what every kind's law promises, and that all who know kinds know those of the
table.
"""

import re
from pathlib import Path

import numpy as np
import pytest

from hw.code_cache import CodeCache
from hw.jit import JIT_DISABLED
from rtctl.client import view_world
from rtctl.client.worlds import Worlds
from rtctl.control.environments import detents, laws
from rtctl.control.environments.kind import SHARED, STIFFNESS, KindFile
from rtctl.control.environments.table import NAMES, OWN, PARAMETERS, Environment, meaning, using
from rtctl.control.jit import records
from rtctl.control.records import new_records
from rtctl.host.exchange.operations import OPERATIONS
from rtctl.rig_file.axis_tables import EnvironmentTable

ROOT = Path(__file__).parents[3]
LOCAL = [kind for kind in Environment if not kind.about.active]
FUNCTIONS = re.findall(r"\* `(\w+)\(s, ", KindFile.__doc__)


def in_force(kind, rng):
    """A law's state with such an environment in force, of random numbers."""
    state = records(new_records(1)[1])
    state["world_kind"] = int(kind)
    for one in PARAMETERS:
        low, high = one.tried
        state[f"world_{one.name}"] = rng.choice([-1, 1]) if one.sign else rng.uniform(low, high)
    state["position_rad"], state["proxy_position_rad"] = rng.uniform(-0.4, 0.4, 2)
    return state[0]


@pytest.mark.parametrize("kind", LOCAL, ids=lambda kind: kind.word)
def test_the_force_on_the_proxy_never_gives_more_than_its_energy_falls(kind):
    rng = np.random.default_rng(int(kind))
    for _ in range(300):
        s = in_force(kind, rng)
        before, stiffness = rng.uniform(-0.4, 0.4), 10.0 ** rng.uniform(0.0, 3.0)
        drive = stiffness * (before + rng.uniform(-0.3, 0.3))
        proxy = laws.solve_proxy(s, 0, drive, stiffness, before, 1e-3)
        rise = laws.environment_energy(s, 0, proxy) - laws.environment_energy(s, 0, before)
        force = drive - stiffness * proxy
        scale = abs(drive * (proxy - before)) + abs(rise)
        assert force * (proxy - before) >= rise - 1e-9 * (1.0 + scale)
        assert laws.environment_energy(s, 0, proxy) >= 0.0


@pytest.mark.parametrize("kind", LOCAL, ids=lambda kind: kind.word)
def test_what_a_kind_says_of_itself_is_so(kind):
    """Parameters it does not name are not felt; without stiffness and damping nothing is: there it is
    exchanged for another.
    """
    rng = np.random.default_rng(int(kind))
    for _ in range(30):
        s = in_force(kind, rng)
        asked = (0, 40.0 * rng.uniform(-0.4, 0.4), 40.0, rng.uniform(-0.4, 0.4), 1e-3)
        felt = laws.solve_proxy(s, *asked)
        for one in PARAMETERS:
            if one not in kind.about.parameters:
                s[f"world_{one.name}"] = -1 if one.sign else 0.0
        assert laws.solve_proxy(s, *asked) == felt
        s["world_stiffness_nm_rad"] = s["world_damping_nms_rad"] = 0.0
        assert laws.solve_proxy(s, *asked) == pytest.approx(asked[1] / 40.0, rel=1e-12, abs=1e-12)
        assert laws.environment_energy(s, 0, felt) == 0.0


@pytest.mark.parametrize("kind", Environment, ids=lambda kind: kind.word)
def test_a_file_holds_nothing_that_nobody_calls(kind):
    public = {name for name, one in vars(kind.file).items() if callable(one) and name in FUNCTIONS}
    assert len(FUNCTIONS) == 4
    if kind.about.active or not kind.about.parameters:
        assert public == set()
    else:
        assert "proxy" in public
    assert ({"energy", "stretch"} <= public) == (STIFFNESS in kind.about.parameters)


def test_a_number_that_is_no_kinds_is_free_space():
    s = in_force(len(Environment) + 70, np.random.default_rng(1))
    assert laws.solve_proxy(s, 0, 3.0, 40.0, 0.1, 1e-3) == 3.0 / 40.0
    assert laws.environment_energy(s, 0, 0.1) == 0.0


def test_numbers_once_given_stay():
    """Records and messages carry them."""
    names = ["free", "spring", "wall", "damper", "detents", "remote"]
    assert [Environment(number).word for number in range(len(names))] == names
    assert [int(kind) for kind in Environment] == list(range(len(Environment)))


def test_a_rig_file_takes_the_kinds_and_parameters_of_the_table():
    assert list(EnvironmentTable.model_fields) == ["kind", *(one.name for one in PARAMETERS)]
    for name in NAMES:
        assert EnvironmentTable(kind=name).kind == name
    for one in PARAMETERS:
        assert getattr(EnvironmentTable(), one.name) == one.default
        for value in (one.low, one.high):
            given = int(value) if one.sign else float(value)
            assert getattr(EnvironmentTable(**{one.name: given}), one.name) == given
        with pytest.raises(ValueError, match=one.name):
            EnvironmentTable(**{one.name: one.high + 1 + abs(one.high)})


def test_messages_records_and_pages_have_the_kinds_and_parameters_of_the_table():
    keys = {key.name: key for key in OPERATIONS["environment"].keys}
    assert keys["kind"].choices == NAMES
    _, state, command, _ = new_records(2)
    sliders = view_world.offered()["sliders"]
    for one in PARAMETERS:
        assert keys[one.name].meaning == meaning(one)
        kind = "i" if one.sign else "f"
        assert command.dtype[f"environment_{one.name}"].base.kind == kind
        assert state.dtype[f"world_{one.name}"].base.kind == kind
        assert (one.name in sliders) == (one.slider is not None)
    assert {kind.word for kind in LOCAL} <= view_world.offered()["worlds"].keys()


def test_a_page_draws_every_world_that_is_felt():
    text = (ROOT / "rtctl" / "client" / "view_static" / "drawings.js").read_text()
    drawn = set(re.findall(r"^  (\w+): \{", text, re.MULTILINE))
    assert drawn == view_world.offered()["worlds"].keys() - {"free", "drag"}


def test_a_parameter_that_is_a_kinds_own_has_a_kind():
    assert PARAMETERS[: len(SHARED)] == SHARED
    assert all(using(one) for one in OWN)


def test_a_client_is_told_of_a_number_that_no_environment_has():
    asked = []

    class Client(Worlds):
        def _result(self, op, **values):
            asked.append((op, values))
            return {}

    numbers = {one.name: one.default for one in PARAMETERS}
    Client().set_environment(0, "wall", **numbers)
    Client().set_environment(0, "wall", center_rad=None)
    assert asked == [("environment", {"axis": 0, "kind": "wall", **more}) for more in (numbers, {})]
    with pytest.raises(TypeError, match=r"no number 'stifness_nm_rad'; there are .*stiffness_nm_rad"):
        Client().set_environment(0, "wall", stifness_nm_rad=2.0)


@pytest.mark.compiled
@pytest.mark.parametrize("function", [laws.solve_proxy, laws.potential, laws.take_own, detents.solve])
def test_what_is_written_from_the_table_is_kept_like_the_rest_of_the_law(function):
    if JIT_DISABLED:
        pytest.skip("nothing is compiled")
    assert isinstance(function._cache, CodeCache)
