"""Leases as others may see them: a lease is a secret of its holder, and whoever reads telemetry or a
recording is another."""

from __future__ import annotations

import hashlib

import numpy as np

NUMBER_BITS = 62


def veil_leases(records: np.ndarray, field: str) -> np.ndarray:
    """Commands or states as others may see them: each lease replaced by a number that tells it from others,
    and no more. The same lease gets the same number in both, so that a replay decides as the loop did."""
    veiled = records.copy()
    for i in np.flatnonzero(records[field]):
        number = int(records[field][i]).to_bytes(8, "big")
        # a hash, not a running number: parts of a recording made apart agree on it
        digest = int.from_bytes(hashlib.blake2b(number, digest_size=8).digest(), "big")
        veiled[field][i] = digest >> (64 - NUMBER_BITS) or 1  # 0 would be no lease
    return veiled
