"""A rig that is ready, and has its full torque, soon after it was asked: for tests that run the law as plain
Python, where a tick takes milliseconds.
"""

from rtctl.check import law_plan

SOON = {"READY_S": 0.1, "SOFT_START_S": 0.1, "MIN_SOFT_START_TICKS": 10}


def start_soon(patch):
    for name, value in SOON.items():
        patch.setattr(law_plan, name, value)
