"""What lies between a host and its clients. Both ends agree on messages, keys, private folders, and events
and faults in words; the host alone opens what is listened at (`endpoints`, `entrances`, `sockets`), and says
who gets in (`authenticator`, `unix_group`) and what a crowd may take (`intruders`, `traffic`, `turnstile`).
"""
