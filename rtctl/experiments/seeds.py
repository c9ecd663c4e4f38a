"""The same measurement with every seed, on all cores."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from rtctl.experiments.order import Order
from rtctl.friction.learn.pool import workers

T = TypeVar("T")


def over_seeds(order: Order, once: Callable[[Order, int], T]) -> list[T]:
    """What `once` finds with each seed, in order.

    Parameters
    ----------
    once
        Receives an order with the same rig and nothing else, and the seed. It runs in another process where
        there are several seeds and cores: what it holds besides has to be data."""
    import joblib

    # progress and announcements are of this process: they cannot be sent along
    bare = Order(order.loaded, order.seeds)
    jobs = min(order.seeds, joblib.cpu_count())
    # a pool of one would only cost its start
    if jobs == 1:
        return [once(bare, seed) for seed in range(order.seeds)]
    with workers("loky", jobs) as pool:
        return list(pool(joblib.delayed(once)(bare, seed) for seed in range(order.seeds)))


def figures_over_seeds(order: Order, once: Callable[[Order, int], dict[str, float]]) -> dict[str, np.ndarray]:
    """Each figure that `once` finds, a value for each seed."""
    rows = over_seeds(order, once)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}
