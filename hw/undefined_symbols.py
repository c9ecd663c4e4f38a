"""What a piece of kept machine code wants from outside: the names that it does not define itself."""

from __future__ import annotations

import struct

import numpy as np

_MAGIC = b"\x7fELF\x02\x01"
"""64 bits, little-endian: the only one that Numba makes on a machine that rtctl runs on."""

_SECTION = np.dtype(  # Elf64_Shdr, what is needed of it (elf(5))
    {
        "names": ["kind", "offset", "size", "link"],
        "formats": ["<u4", "<u8", "<u8", "<u4"],
        "offsets": [4, 24, 32, 40],
        "itemsize": 64,
    }
)
_SYMBOL = np.dtype(  # Elf64_Sym
    [("name", "<u4"), ("info", "u1"), ("other", "u1"), ("section", "<u2"), ("value", "<u8"), ("size", "<u8")]
)
_SYMBOL_TABLE = 2  # SHT_SYMTAB


def undefined_symbols(code: bytes) -> set[str]:
    """Names that an object file wants from elsewhere.

    Raises
    ------
    ValueError
        It is no 64-bit little-endian ELF file, or a damaged one."""
    # 64: the length of an ELF header; shorter, the offsets below would be read beyond its end
    if not code.startswith(_MAGIC) or len(code) < 64:
        raise ValueError("not an ELF file of 64 bits")
    (at,) = struct.unpack_from("<Q", code, 0x28)  # e_shoff
    (count,) = struct.unpack_from("<H", code, 0x3C)  # e_shnum
    # raises ValueError where the file ends before it: nothing behind a damaged file is read
    sections = np.frombuffer(code, _SECTION, count, at)
    wanted: set[str] = set()
    for table in sections[sections["kind"] == _SYMBOL_TABLE]:
        symbols = np.frombuffer(code, _SYMBOL, int(table["size"]) // _SYMBOL.itemsize, int(table["offset"]))
        begins = int(sections[int(table["link"])]["offset"])
        # SHN_UNDEF; the first symbol of each table is an empty one
        named = symbols[(symbols["section"] == 0) & (symbols["name"] != 0)]
        for place in named["name"]:
            name = begins + int(place)
            wanted.add(code[name : code.index(b"\0", name)].decode())
    return wanted
