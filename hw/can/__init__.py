"""CAN devices: drives with a known protocol (ODrive, moteus, CiA 402) and boards described by a field map.

bus        python-can for every interface, a raw socket for SocketCAN; error frames become bus health
codecs     pure: bytes to numbers and back, one file per protocol, and generic fields (also from a DBC)
drives     what a protocol does to arm, command and disarm one axis
backend    one bus, its drives, one sample
load       whether all frames fit on the wire in one period
*_sim      devices on the same bus with watchdogs of their own, for tests and for trying a rig file"""
