"""What things hold: the bytes of all arrays that can be reached from them."""

import numpy as np
import warp as wp


def arrays_of(thing, met: dict) -> None:
    """Find all arrays that something holds, by their addresses: device arrays, NumPy's, those of structs."""
    if id(thing) in met:
        return
    met[id(thing)] = (None, thing)
    if isinstance(thing, wp.array):
        met[id(thing)] = ((thing.ptr or 0, thing.capacity), thing)
    elif isinstance(thing, np.ndarray):
        owner = thing
        while isinstance(owner.base, np.ndarray):
            owner = owner.base
        met[id(thing)] = ((owner.__array_interface__["data"][0], owner.nbytes), thing)
    elif isinstance(thing, (dict, list, tuple)):
        for part in thing.values() if isinstance(thing, dict) else thing:
            arrays_of(part, met)
    elif type(thing).__module__.startswith("warpsim"):
        for part in vars(thing).values() if hasattr(thing, "__dict__") else ():
            arrays_of(part, met)
    elif hasattr(getattr(thing, "_cls", None), "vars"):
        for name in thing._cls.vars:
            arrays_of(getattr(thing, name), met)


def bytes_held(*things) -> int:
    """Bytes of all arrays that things hold; views and what several hold count once."""
    met, total, end = {}, 0, 0
    arrays_of(things, met)
    for address, size in sorted(span for span, _ in met.values() if span):
        total += max(0, address + size - max(end, address))
        end = max(end, address + size)
    return total
