"""From a recording to friction samples, rigid-body parameters and what is wrong with the log."""
