"""Simulated devices, for tests and for trying a rig file without its rig. `mock_*` is a whole rig in one
process: DC motor, gearbox, friction, sensors and a scripted hand, with the truth at hand. The others speak as
the real ones do: drives on a CAN bus (`can_*`), boards on a serial line (`serial_*`)."""
