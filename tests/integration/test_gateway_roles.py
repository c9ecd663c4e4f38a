"""What each role may do, over real TCP: every operation of the table, and leases."""

import pytest
from patience import until

from rtctl.errors import RefusedError
from rtctl.host.exchange.operations import OPERATIONS
from rtctl.wire.protocol import ROLES


def request_for(operation):
    """A well-formed request for an operation of the table, whatever it is."""
    example = {"axis": 0, "numbers": [0.1], "number": 0.5, "lease": "0" * 16}
    keys = {
        key.name: key.choices[0] if key.choices else example[key.kind]
        for key in operation.keys
        if key.required
    }
    return {"epoch": 1, **keys} if operation.needs_epoch else keys


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("op", OPERATIONS)
def test_every_operation_is_open_to_its_roles_and_closed_to_all_others(rig, client, role, op):
    operation = OPERATIONS[op]
    asked = client(role)
    before = rig.writer.command.tobytes()
    try:
        asked._call(op, **request_for(operation))
        code = "ok"
    except RefusedError as refused:
        code = refused.code
    if ROLES.index(role) < ROLES.index(operation.role):
        assert code == "forbidden"
        assert rig.writer.command.tobytes() == before
        assert rig.gateway.counters.forbidden == 1
    else:
        assert code in ("ok", "not_ready", "lease_lost", "missing_key", "out_of_bounds")


def test_the_table_of_roles_is_the_one_of_the_safety_document():
    assert OPERATIONS["stop"].role == "observer", "anybody may stop"
    for op in ("arm", "reset", "tare", "compensation", "adapt"):
        assert OPERATIONS[op].role == "operator", op
    for op in ("lease", "release", "target", "environment"):
        assert OPERATIONS[op].role == "renderer", op


def test_a_renderer_moves_the_proxy_over_tcp_and_its_lease_keeps_a_second_one_out(rig, client):
    renderer, other, operator = client("renderer"), client("renderer"), client("operator")
    operator.arm()
    assert renderer.hello()["role"] == "renderer"
    with renderer.lease() as lease:
        until(lambda: lease.set_target([0.5]) or rig.writer.command["target_position_rad"][0][0] == 0.5)
        with pytest.raises(RefusedError, match=r"lease_taken: the-renderer holds"):
            other.lease()
        renderer.set_environment(0, "spring", stiffness_nm_rad=2.0, lease=lease)
        with pytest.raises(RefusedError, match="with the lease only"):
            other.set_environment(0, "spring", stiffness_nm_rad=3.0)
        observer = client("observer")
        observer.stop()
        until(lambda: lease.lost)
        with pytest.raises(RefusedError, match="lease_lost"):
            lease.set_target([0.6])
    assert rig.writer.command["environment_stiffness_nm_rad"][0][0] == 2.0


def test_a_lease_seen_by_others_is_of_no_use_to_them(rig, client):
    renderer, operator = client("renderer"), client("operator")
    operator.arm()
    with renderer.lease() as lease:
        with pytest.raises(RefusedError, match="lease_lost"):
            operator._call("target", epoch=lease.epoch, lease=lease.text, position_rad=[1.0])
        with pytest.raises(RefusedError, match="lease_lost"):
            operator._call("release", lease=lease.text)
