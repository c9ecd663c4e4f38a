"""The client of a running rig: what the author of a virtual world uses.

>>> with RigClient("mock") as rig:  # doctest: +SKIP
...     rig.set_environment(0, "spring", stiffness_nm_rad=2.0)
...     rig.arm()
...     for sample in rig.states():
...         draw(sample.position_rad[0], sample.hand_torque_nm[0])

A renderer that moves the virtual object itself holds the lease:

>>> with RigClient("mock") as rig, rig.lease() as lease:  # doctest: +SKIP
...     rig.set_environment(0, "remote")
...     rig.arm(meanwhile=lambda: lease.set_target(lease.start_rad))
...     for sample in rig.states(max_age_s=0.1):
...         lease.set_target(world(sample))

Light on purpose: NumPy, pyzmq and msgpack. `docs/protocol.md` describes the same for other languages."""

from rtctl.client.lease import Lease
from rtctl.client.rig import RigClient
from rtctl.client.samples import RigState
from rtctl.client.streams import Stream
from rtctl.control.vocabulary import Fault, State
from rtctl.wire.protocol import Endpoints

__all__ = ["Endpoints", "Fault", "Lease", "RigClient", "RigState", "State", "Stream"]
