"""Seeded bugs of which core the loop takes, who keeps off it, and what is spared on the others."""

from __future__ import annotations

from seed import Seed

CORE = ("tests/unit/rt/test_core.py",)

SEEDS = (
    Seed(
        "another core's interrupts are the loop's", "rtctl/rt/core.py",
        "return self.counts[core] if core < len(self.counts) else 0", "return self.counts[0]",
        ("tests/unit/doctor/test_doctor_machine.py::test_devices_that_interrupt_the_loops_core_are_named_with_the_way_to_"
         "move_them", *CORE),
    ),
    Seed(
        "the loop stays where the disk interrupts it", "rtctl/rt/core.py",
        "    if counts[last] < busy or counts[last] < FEWER * counts[quiet]:\n", "    if True:\n", CORE,
    ),
    Seed(
        "the loop's core changes with a few interrupts", "rtctl/rt/core.py",
        "counts[last] < FEWER * counts[quiet]", "counts[last] <= counts[quiet]", CORE,
    ),
    Seed(
        "the loop flees from its own timer", "rtctl/rt/core.py",
        "devices and not _OF_A_CORE.search(devices) and all", "devices and all", CORE,
    ),
    Seed(
        "a core that the rig file names is only a wish", "rtctl/rt/core.py",
        "    if asked >= 0:\n", "    if asked in allowed:\n", CORE,
    ),
    Seed(
        "an isolated core is like others", "rtctl/rt/core.py",
        "if cores), (allowed, \"\")", "if False), (allowed, \"\")", CORE,
    ),
    Seed(
        "an isolated core is taken that is not allowed", "rtctl/rt/core.py",
        'name: cores_of(_text(root / _CPU / name)) & allowed', 'name: cores_of(_text(root / _CPU / name))',
        CORE,
    ),
    Seed(
        "ZeroMQ's threads stay on the loop's core", "rtctl/host/loop_process.py",
        "for thread in _threads() if core >= 0 else ():", "for thread in [os.getpid()] if core >= 0 else ():",
        ("tests/unit/host/test_loop_process.py",),
    ),
    Seed(
        "the host stays off a core that no loop has any more", "rtctl/host/loop_process.py",
        "                    os.sched_setaffinity(thread, cores)\n", "                    pass\n",
        ("tests/unit/host/test_loop_process.py",),
    ),
    Seed(
        "a column of another width is taken for words",
        "rtctl/client/samples.py",
        '            and (column["dtype"], column["shape"]) == (word.dtype, [n, *word.shape])\n',
        "",
        ("tests/unit/test_broken_telemetry.py::test_one_column_that_is_not_like_the_others_is_read_by_itself",),
    ),
    Seed(
        "columns of words are those of the word before",
        "rtctl/host/exchange/samples.py",
        "flat[8 * n * word.place : 8 * n * (word.place + 1)]",
        "flat[8 * n * (word.place - 1) : 8 * n * word.place]",
        ("tests/unit/host/test_telemetry_parts.py::test_columns_of_any_record_are_its_fields",),
    ),
    Seed(
        "a field that is half a word is copied as one",
        "rtctl/tick.py",
        "if dtype.itemsize == dtype.base.itemsize == 8 and not place % 8 and not record.itemsize % 8",
        "if dtype.itemsize == dtype.base.itemsize and not record.itemsize % 8",
        ("tests/unit/host/test_telemetry_parts.py::test_columns_of_any_record_are_its_fields",),
    ),
    Seed(
        "the page reads ticks that nobody looks at",
        "rtctl/client/view_feed.py",
        "        while self._followed.wait() and",
        "        while self._followed.set() is None and",
        (
            "tests/integration/test_view_streams.py::test_ticks_are_read_while_somebody_looks_and_forgotten_when_nobody_does",
        ),
    ),
    Seed(
        "who opens the page sees ticks of the last time it was open",
        "rtctl/client/view_feed.py",
        "            self._ticks_while_followed()\n            self._begin()\n",
        "            self._ticks_while_followed()\n",
        (
            "tests/integration/test_view_streams.py::test_ticks_are_read_while_somebody_looks_and_forgotten_when_nobody_does",
        ),
    ),
    Seed(
        "one of two browsers that closes stops the other",
        "rtctl/client/view_feed.py",
        "            if not self._followers:\n                self._followed.clear()",
        "            self._followed.clear()",
        (
            "tests/integration/test_view_streams.py::test_ticks_are_read_while_somebody_looks_and_forgotten_when_nobody_does",
        ),
    ),
)  # fmt: skip
