"""A rig that was stopped because this machine stood still: whoever asks for something else asks again."""

from contextlib import contextmanager

import pytest
from patience import PATIENCE_S, until

from rtctl.client import RigClient
from rtctl.errors import RefusedError

OF_THIS_MACHINE = {"TARGET_LOST", "HOST_SILENT", "OVERRUN", "STALLED"}
"""Faults of a renderer, a host or a loop that came too late."""

VOID = {"wrong_epoch", "lease_lost", "not_ready"}
"""How a request is refused after a stop."""

TRIES = 3


@contextmanager
def patient_clients():
    """Clients of this process wait for as long as a loaded machine may take, where nobody says how long."""
    with pytest.MonkeyPatch.context() as patience:
        patience.setitem(RigClient.__init__.__kwdefaults__, "timeout_s", PATIENCE_S)
        yield patience


def stopped_by(rig, events):
    """Names of the faults that have stopped a rig, once it is at rest, by a stream of its events from before
    that; none where its host had stood still, which then stops it without a fault.
    """
    faults = set()

    def is_over():
        event = events.receive(1.0)
        if event is None:  # a stop of a rig at rest is no event
            return rig.status()["state"] in ("IDLE", "FAULT")
        faults.update({event["name"]} if event["event"] == "fault" else ())
        return event.get("to") in ("IDLE", "FAULT")

    until(is_over, "the end of a stop")
    return faults


def undisturbed(rig, attempt):
    """What `attempt` gives, which arms the rig; tried anew where it was refused because this machine stood
    still.
    """
    for left in reversed(range(TRIES)):
        with rig.events() as events:
            try:
                return attempt()
            except RefusedError as refused:
                if not left or refused.code not in VOID or not stopped_by(rig, events) <= OF_THIS_MACHINE:
                    raise
        if rig.status()["state"] == "FAULT":
            rig.reset(timeout_s=PATIENCE_S)
    return None
