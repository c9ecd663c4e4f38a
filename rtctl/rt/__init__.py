"""The loop process: wait, read, decide, write, record. No network, no log, no learner in here."""
