"""Which policies leave a hand that holds still alone: one table for `rtctl check`, campaign and documents.

Every policy is bounded in energy by the account of the compensation (`control.assistance`); this is about
what a hand feels of it at rest. Measured on 1200 random joints (LuGre, elasto-plastic, Maxwell-slip) in
random hands (0 to 500 N m/rad, 0 to 1 N m s/rad, 0 to .02 kg m^2) that move and then hold still: bad is a
speed above .002 rad/s RMS from 2 s after the motion on, or more than 1 mJ fed to the hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Standing:
    """What was measured of a policy."""

    quiet: bool
    evidence: str


STANDINGS: Mapping[str, Standing] = {
    "off": Standing(quiet=True, evidence="no help with friction at all"),
    "hybrid": Standing(
        quiet=True,
        evidence="2 of 5017 hands that held still were not at rest after 2 s: heavy ones without damping "
        "that swung out; fed .007 mJ at most",
    ),
    "observer": Standing(
        quiet=True, evidence="0 of 5015 hands that held still kept more than .002 rad/s; fed .005 mJ at most"
    ),
    "sign": Standing(quiet=False, evidence="45 % of the hands that held still were shaken"),
    "dither": Standing(quiet=False, evidence="25 % of the hands that held still were shaken"),
    "tanh": Standing(quiet=False, evidence="13 % of the hands that held still were shaken"),
    "deadband": Standing(quiet=False, evidence="it jumps at the edge of its band as sign does at rest"),
    "intent": Standing(
        quiet=False, evidence="19 % of the hands that held still were shaken, without its low-pass"
    ),
    "stop": Standing(quiet=False, evidence="9 % of the hands that held still were shaken"),
    "stop_gated": Standing(quiet=False, evidence="6 % of the hands that held still were shaken"),
    "lugre": Standing(quiet=False, evidence="a stop operator of another shape: not shown to be quiet"),
}
"""Every policy by its name in the rig file."""
