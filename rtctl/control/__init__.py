"""The compiled control law: pure functions on records, no I/O, no clock, no log.

`law.step` is one tick. Everything it needs comes in five records (see `records`), everything it
decides goes out in the tick and the state, so the same function runs in the loop, in a simulation at
hundreds of times real time, and in a replay, with equal results bit for bit. What is proved of it before it
runs stands in `proofs`, which the law does not know."""
