"""Every tick of some random rigs that live through random faults, requests and targets (`campaign_run`)."""

import numpy as np

from rtctl.simulation.campaign_run import TWO_AXES_OF, Order, run_traced

SEED, RIGS, TICKS, FAULTS = 20, 40, 8000, 16


def random_lives():
    """Parameters and ticks of each rig of one axis."""
    order = Order(seed=SEED, rigs=RIGS, ticks=TICKS, faults=FAULTS)
    out = []
    for index in range(RIGS):
        if index % TWO_AXES_OF:
            _, rig, ticks = run_traced(order, index, keep=TICKS)
            out.append((rig.simulation.params[0].copy(), ticks.view(np.ndarray)))
    return out


def axis_column(ticks, name):
    return ticks[name][:, 0]


def before(column):
    """Each row's value in the tick before; the first row has its own."""
    return np.r_[column[:1], column[:-1]]
