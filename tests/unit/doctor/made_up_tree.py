"""A made-up tree of a machine's files, and what the doctor says of a device in it."""

from rtctl.host import machine_wiring


def put(root, path, content):
    target = root / path
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(content + "\n")


def look(root, options, ask=lambda _command: ""):
    return machine_wiring.check(root, [("device[0] 'drive'", options)], ask)


def process(root, pid, command, holds=None):
    put(root, f"proc/{pid}/cmdline", command.replace(" ", "\0"))
    (root / f"proc/{pid}/fd").mkdir(parents=True)
    if holds:
        (root / f"proc/{pid}/fd/3").symlink_to(holds)
