"""Seeded bugs of devices, recordings and the service that were known for long before they were mended."""

from __future__ import annotations

from seed import Seed

AXES = ("tests/unit/hw/test_can_axes.py",)
FLOODS = ("tests/unit/hw/test_can_steady.py::test_what_a_flood_leaves_for_the_next_cycle_is_no_fresh_sample",)
LINES = (
    "tests/unit/hw/test_serial_compiled_cycle.py"
    "::test_a_backlog_is_taken_in_and_neither_it_nor_its_rest_is_shown_as_fresh",
)
RDT = ("tests/contract/test_rdt_sensor.py",)
SERIAL_SENSORS = ("tests/contract/test_force_sensors.py",)
STOPS = ("tests/unit/hw/test_stop_sequence.py",)

SEEDS = (
    Seed(
        "a linear motor on a CAN drive goes 6 m a turn",
        "hw/can/sample.py",
        'if motion == "linear" and not lead_m:',
        "if False:",
        AXES,
    ),
    Seed(
        "a described board that saw a later number ignores the stop",
        "hw/serial/described_backend.py",
        "        if not counted:\n",
        "        if True:\n",
        STOPS,
    ),
    Seed(
        "a described board is deaf to commands after a stop",
        "hw/serial/described_backend.py",
        "        if self._stopped_at is not None:\n",
        "        if False:\n",
        STOPS,
    ),
    Seed(
        "a CAN board that saw a later number ignores the stop of another process",
        "hw/can/board_out.py",
        "            counter.count = number - 1  # `send` counts first\n",
        "",
        STOPS,
    ),
    Seed(
        "what a flood of CAN leaves for the next cycle is fresh",
        "hw/can/backend.py",
        "slot if drained else slot - UNKNOWN_AGE_TICKS",
        "slot",
        FLOODS,
    ),
    Seed(
        "what a flood of CAN leaves for the next compiled cycle is fresh",
        "hw/can/steady_cycle.py",
        "slot - UNKNOWN_AGE_TICKS if drained == _MORE else slot",
        "slot",
        FLOODS,
    ),
    Seed(
        "what is left of a backlog of a port is fresh",
        "hw/serial/backend.py",
        'size[1] = BACKLOGGED if self._wire["behind"][0] else DRAINED',
        "size[1] = DRAINED",
        LINES,
    ),
    Seed(
        "what is left of a backlog of a port is fresh in a compiled cycle",
        "hw/serial/compiled_core.py",
        "BACKLOGGED if p.behind else DRAINED",
        "DRAINED",
        LINES,
    ),
    Seed(
        "what is left of a backlog of RDT records is fresh",
        "hw/force/rdt_backend.py",
        "if drained and not behind:",
        "if drained:",
        RDT,
    ),
    Seed(
        "what is left of a full port of a force sensor is fresh",
        "hw/force/serial_backend.py",
        "if full or behind:",
        "if full:",
        SERIAL_SENSORS,
    ),
    Seed(
        "a board of lines may let go within a period",
        "hw/option_tables.py",
        "if rate_hz and time_to_live_ms < 2e3 / rate_hz:",
        "if False:",
        ("tests/unit/hw/test_serial_lines_commands.py",),
    ),
    Seed(
        "a board may send a backlog in every cycle",
        "hw/serial/backend.py",
        "    if most >= BACKLOG:\n",
        "    if False:\n",
        ("tests/unit/hw/test_serial_described_commands.py",),
    ),
    Seed(
        "compare says nothing of --fields without --plot",
        "rtctl/cli/plot.py",
        "if fields is not None and plot is None:",
        "if False:",
        ("tests/unit/cli/test_recording_argument.py",),
    ),
    Seed(
        "a recording is left to the kernel for half a minute",
        "rtctl/recording/parts.py",
        "            self._file.bring_to_disk()\n",
        "",
        ("tests/unit/recording/test_recorder.py::test_a_power_cut_costs_two_seconds_at_most",),
    ),
    Seed(
        "what a rig keeps of an experiment cannot be read again",
        "rtctl/experiments/kept_runs.py",
        "MOST_BYTES = 1 << 31",
        "MOST_BYTES = 1 << 30",
        (
            "tests/unit/experiments/test_kept_runs.py"
            "::test_what_the_longest_experiment_keeps_on_the_quickest_loop_can_be_read_again",
        ),
    ),
    Seed(
        "a burst of lines hides why the rig stopped",
        "rtctl/host/speaker.py",
        '"state" if decides else "run"',
        '"run"',
        ("tests/unit/host/test_speaker.py",),
    ),
    Seed(
        "what is meant for another rig is carried out",
        "rtctl/host/exchange/messages.py",
        "    _require_rig(message, rig)\n",
        "",
        ("tests/unit/host/test_message_decoder.py",),
    ),
    Seed(
        "a client takes whatever rig answers for its own",
        "rtctl/client/requests.py",
        'if self._rig is None and isinstance(reply.get("rig"), str):',
        "if False:",
        ("tests/unit/test_client.py",),
    ),
    Seed(
        "an older daemon refuses in words that say nothing",
        "rtctl/client/requests.py",
        "if code in NEWER:",
        "if False:",
        ("tests/unit/test_client.py",),
    ),
)
