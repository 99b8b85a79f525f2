"""Population: the arrays of one system's mass points, every field a row or rows of one slab of 32-bit words.

Compaction and sorting move columns of the slab, so that no field, solver history included, can be forgotten.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import warp as wp

from warpsim.keeping import KeptArray
from warpsim.kernels import emission
from warpsim.kernels.snippets import BLOCK

COUNTERS = {"live": emission.LIVE, "active": emission.ACTIVE, "born": emission.BORN, "refused": emission.REFUSED}
COUNTERS |= {"killed": emission.KILLED, "next_id": emission.NEXT_ID, "fault": emission.FAULT}
COUNTERS |= {"children": emission.CHILDREN, "pushed": emission.PUSHED, "coarse": emission.COARSE}


@dataclass(frozen=True)
class Field:
    """Shape, type and unit of one per-particle quantity."""

    rows: int
    dtype: type
    unit: str
    meaning: str


FIELDS = {
    "position": Field(3, wp.float32, "m", "where it is at the frame"),
    "velocity": Field(3, wp.float32, "m/s", "how fast it moves; a tracer's is the flow's"),
    "birth_frame": Field(1, wp.int32, "1", "number of the frame in whose step it was born"),
    "birth_age": Field(1, wp.float32, "s", "its age at that frame"),
    "lifetime": Field(1, wp.float32, "s", "age at which it dies"),
    "mass": Field(1, wp.float32, "kg", "inertia"),
    "radius": Field(1, wp.float32, "m", "for Stokes drag"),
    "id": Field(2, wp.uint32, "1", "running number of births: low word, high word"),
}


def history_fields(past: int) -> dict[str, Field]:
    """Return the rows that a multistep method keeps of so many past values."""
    if not past:
        return {}
    return {
        "history": Field(3 * past, wp.float32, "m/s^2 or m/s", "drive at earlier substeps, latest first (kernels/multistep.py, staged.py)"),
        "history_count": Field(1, wp.int32, "1", "how many of them there are: fewer after birth and after a collision"),
    }


CONTACT = {"contact": Field(1, wp.int32, "1", "place in the table of the collider that it sticks to, plus 1; 0: free")}


class Population:
    """Planar fields (rows, capacity) as views of one slab; `capacity` is rounded up to whole blocks, `limit` is what was asked.

    Live particles fill columns 0 … live − 1 in order of birth.
    """

    def __init__(self, limit: int, fields: dict[str, Field], device: str):
        self.limit, self.device = limit, device
        self.capacity = -(-limit // BLOCK) * BLOCK
        self.fields = fields
        self.slab = wp.zeros((sum(field.rows for field in fields.values()), self.capacity), dtype=wp.uint32, device=device)
        self.alive = wp.zeros(self.capacity, dtype=int, device=device)
        self.counters = wp.zeros(emission.COUNTER_COUNT, dtype=wp.int64, device=device)
        self._rows, row = {}, 0
        for name, field in fields.items():
            self._rows[name] = slice(row, row + field.rows)
            row += field.rows
        self._on_host = self.counters.numpy() if wp.get_device(device).is_cpu else None

    def field(self, name: str) -> wp.array:
        """Return a field as a device array, (3, capacity) or (capacity,)."""
        rows, dtype = self._rows[name], self.fields[name].dtype
        view = self.slab[rows.start] if self.fields[name].rows == 1 else self.slab[rows]
        return view.view(dtype)

    def rows(self, count: int) -> wp.array:
        """Return the slab's first rows as float32 (count, capacity): position, velocity, …."""
        return self.slab[:count].view(wp.float32)

    def view(self, position: str = "position", velocity: str = "velocity") -> emission.Particles:
        """Return the population as its kernels see it, with the given fields for position and velocity."""
        view = emission.Particles()
        view.position, view.velocity, view.alive = self.field(position), self.field(velocity), self.alive
        for name in self.fields:
            if name in emission.Particles.vars and name not in ("position", "velocity"):
                setattr(view, name, self.field(name))
        return view

    def counter(self, name: str) -> int:
        """Return one counter; free on the CPU, waits for the device on a GPU."""
        values = self.counters.numpy() if self._on_host is None else self._on_host
        return int(values[COUNTERS[name]])

    def host(self, name: str) -> np.ndarray:
        """Return a copy of a field's live columns, (rows, live) or (live,)."""
        return np.array(columns(self.field(name), self.counter("live")))

    def arrays(self) -> dict[str, np.ndarray]:
        """Return everything that makes up the state: counters and the slab's live columns; on the CPU views of the arrays themselves."""
        return {"counters": self.counters.numpy(), "slab": columns(self.slab, self.counter("live"))}

    def restore(self, state: Mapping[str, KeptArray]) -> None:
        """Take back what arrays() were when they were kept."""
        put_columns(self.slab, state["slab"])
        self.counters.assign(state["counters"].whole())

    def clear(self) -> None:
        """Remove all particles and forget the fault; the emitters go on."""
        counters = self.counters.numpy()
        counters[[emission.LIVE, emission.ACTIVE, emission.FAULT]] = 0
        self.counters.assign(counters)


def columns(array: wp.array, count: int) -> np.ndarray:
    """Return the first columns of an array (rows, n) or (n,): on the CPU a view of it, from a GPU no more than these."""
    if array.device.is_cpu or count == array.shape[-1]:
        return array.numpy()[..., :count]
    if count == 0:
        return np.zeros((*array.shape[:-1], 0), wp.dtype_to_numpy(array.dtype))
    return (array[:count] if array.ndim == 1 else array[:, :count]).contiguous().numpy()


def put_columns(array: wp.array, kept: KeptArray) -> None:
    """Put kept rows back into the first columns of an array (rows, n)."""
    count = kept.shape[1]
    if array.device.is_cpu:
        for row, values in zip(array.numpy(), kept, strict=True):
            row[:count] = values
    elif count:
        wp.copy(array[:, :count], wp.array(kept.whole(), dtype=array.dtype, device=array.device))
