"""The commands of `rtctl`, by what they are for: where each of them is, so that only the one that is asked
for is imported."""

from __future__ import annotations

SECTIONS: dict[str, dict[str, tuple[str, str]]] = {
    "Try it": {
        "demo": ("rtctl.cli.demo", "friction compensation off, then on, on a simulated rig"),
        "init": ("rtctl.cli.init", "copy a shipped rig file; without arguments list them"),
        "run": ("rtctl.cli.run", "run the rig of a rig file, until Ctrl-C"),
        "view": ("rtctl.cli.view", "a running rig in the browser: scope, faults, STOP"),
        "world": ("rtctl.cli.view:world", "a virtual world to push, in the browser"),
    },
    "Operate a running rig": {
        "status": ("rtctl.cli.operate:status", "state, faults with their remedy, who holds the lease"),
        "arm": ("rtctl.cli.operate:arm", "from here on the motor may move"),
        "stop": ("rtctl.cli.operate:stop", "ramp the torque to zero, disable the motor; never refused"),
        "reset": ("rtctl.cli.operate:reset", "leave FAULT or ESTOP once the cause has gone"),
        "tare": ("rtctl.cli.operate:tare", "take the present force as zero"),
        "adapt": ("rtctl.cli.operate:adapt", "follow the friction that is seen, or hold it"),
        "monitor": ("rtctl.cli.monitor", "state, torques, latency and losses, as they change"),
        "events": ("rtctl.cli.events", "what happened: states, faults, incidents"),
        "stop-rig": ("rtctl.cli.stop_rig", "make actuators torque-free where no daemon answers"),
    },
    "Set up a rig": {
        "check": ("rtctl.cli.check", "is its rig file sound, its coupling provably passive?"),
        "doctor": ("rtctl.cli.doctor", "is this machine ready: kernel, rights, devices, wake-ups?"),
        "probe": ("rtctl.cli.probe", "what its devices measure, with nothing armed"),
        "compile": ("rtctl.cli.compile", "compile now what its first start would"),
        "service": ("rtctl.cli.service", "start it with the machine, by systemd"),
        "keys": ("rtctl.cli.keys", "keys of clients on other machines"),
    },
    "Learn its friction": {
        "identify": ("rtctl.cli.identify", "measure friction on the rig, or from logs"),
        "fit": ("rtctl.cli.fit", "learn a friction model from points, or judge one"),
        "evidence": ("rtctl.cli.evidence", "how every model does on your data sets"),
        "drift": ("rtctl.cli.drift", "is the friction of a recording still what was learned?"),
        "playback": ("rtctl.cli.playback", "what compensation would have done to a recorded log"),
    },
    "Look at recordings": {
        "record": ("rtctl.cli.record", "record a running rig, until Ctrl-C"),
        "info": ("rtctl.cli.info", "rig, versions, duration, losses and states"),
        "plot": ("rtctl.cli.plot", "draw motion, torques, energies, timing, state"),
        "compare": ("rtctl.cli.plot:compare", "two recordings: feel, motor, punctuality"),
        "replay": ("rtctl.cli.replay", "run the law over it again, bit for bit"),
        "export": ("rtctl.cli.export", "write npz, Parquet, CSV, or MCAP tick by tick"),
        "incident": ("rtctl.cli.incident", "what led to a fault"),
    },
    "Measure and prove": {
        "experiment": ("rtctl.cli.experiment", "the experiments of both papers, with a report"),
        "campaign": ("rtctl.cli.campaign", "random rigs and faults against the safety contract"),
        "bench": ("rtctl.cli.bench", "how quick and punctual it is here; in a checkout"),
    },
    "For programs": {
        "schema": ("rtctl.cli.schema", "JSON Schema of the tick record, or of the rig file"),
        "completion": ("rtctl.cli.completion", "what a shell completes after `rtctl`"),
    },
}
"""Title -> command name -> the module whose `command` it is, or `module:name`, and what it does, for one line
of the list."""

COMMANDS: dict[str, str] = {
    name: where for section in SECTIONS.values() for name, (where, _) in section.items()
}
"""Command name -> the module whose `command` it is, or `module:name`."""
