"""The topics of a recording, each with the number that rtctl gives its channel."""

TICK, EVENT, COMMAND, LOG, COLUMNS, STATE = 1, 2, 3, 5, 6, 7
TOPICS = {
    TICK: "rtctl/tick", EVENT: "rtctl/event", COMMAND: "rtctl/command", LOG: "rtctl/log",
    COLUMNS: "rtctl/tick_columns", STATE: "rtctl/law_state",
}  # fmt: skip
