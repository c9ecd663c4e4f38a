"""Who gets in: sockets, keys, groups, and what a crowd may take."""
