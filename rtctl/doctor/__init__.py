"""What `rtctl doctor` looks at: machine, rights, wiring, software, and how late the loop's core wakes up.

Every check is a function of a root folder (`/`, or a made-up tree in tests) that returns `Line`s and changes nothing.
"""
