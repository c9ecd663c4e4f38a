"""The topics of a recording, each with the number that rtctl gives its channel."""

TICK, EVENT, COMMAND, LOG = 1, 2, 3, 5
TOPICS = {TICK: "rtctl/tick", EVENT: "rtctl/event", COMMAND: "rtctl/command", LOG: "rtctl/log"}
