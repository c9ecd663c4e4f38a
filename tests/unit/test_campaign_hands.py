"""Hands of a certified rig are drawn apart from the rig, and from each other."""

from types import SimpleNamespace

import numpy as np

from rtctl.simulation import campaign_certified_pairs


def test_no_hand_is_drawn_from_the_stream_of_its_rig(monkeypatch):
    streams = []
    generator = np.random.default_rng

    def noted(seed):
        streams.append(tuple(np.random.SeedSequence(seed).generate_state(2)))
        return generator(seed)

    monkeypatch.setattr(np.random, "default_rng", noted)
    box = SimpleNamespace(stiffness_nm_rad=1.0, damping_nms_rad=1.0, inertia_kgm2=1.0)
    for index in range(2):
        noted((7, index))  # as `drawn` draws the rig
        rig = SimpleNamespace(index=index, loop=SimpleNamespace(box=box))
        for number in range(campaign_certified_pairs.PAIRS):
            campaign_certified_pairs.pair(rig, 7, number)
    assert len(streams) == len(set(streams)) == 2 * (1 + campaign_certified_pairs.PAIRS)
