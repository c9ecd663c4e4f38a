"""Memory that was needed once goes back to the system."""

import subprocess
import sys

LATER = """
import ctypes, re
from rtctl.wire.freed_memory import TRIM_S, Heap

def resident_kb():
    return int(re.search(r"RssAnon:\\s+(\\d+)", open("/proc/self/status").read())[1])

libc = ctypes.CDLL(None)
libc.malloc.restype, libc.free.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
blocks = [libc.malloc(60_000) for _ in range(300)]
for block in blocks:
    ctypes.memset(block, 1, 60_000)
full = resident_kb()
for block in blocks[:-1]:  # the last one holds the top of the heap where it is
    libc.free(block)
freed = resident_kb()
heap = Heap()
heap.look(100.0)
trimmed = resident_kb()
again = [libc.malloc(60_000) for _ in range(100)]
for block in again:
    ctypes.memset(block, 1, 60_000)
for block in again:
    libc.free(block)
before = resident_kb()
heap.look(100.0 + 0.9 * TRIM_S)
early = resident_kb()
heap.look(100.0 + TRIM_S)
print(full, freed, trimmed, before, early, resident_kb())
"""


def test_what_is_freed_goes_back_now_and_then():
    said = subprocess.run([sys.executable, "-c", LATER], capture_output=True, text=True, check=True).stdout
    full, freed, trimmed, before, early, late = map(int, said.split())
    assert full - freed < 3_000  # the library keeps it
    assert freed - trimmed > 12_000
    assert early > before - 500
    assert early - late > 4_000
