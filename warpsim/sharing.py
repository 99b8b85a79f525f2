"""Sharing: what of a frame all cores carry out together, and what is one core's, worked out from how long each takes one core."""

from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

MEETING = 1.0e-6  # s that cores lose when they meet, beside those at which they wait for the slowest
HANDING_OUT = 10e-6  # s until the others are at work, and the caller knows that they are done
WORTH = 0.9  # of the present time of a frame: what a change has to bring
OFFSET = 256  # elements: what a system without any costs, in elements
MEASURED = 3  # last frames whose middle is taken: a first one finds its memory cold
PLAIN = 20 * HANDING_OUT  # s of work from which one measurement is enough to begin with


@dataclass(frozen=True)
class Plan:
    """Who does what: the companies (names) that all cores share, one after the other, and before them those that are each core's own."""

    shared: tuple[str, ...]
    own: tuple[tuple[str, ...], ...]

    @property
    def core_count(self) -> int:
        """Number of cores at work."""
        return len(self.own)

    def cost(self, work: Mapping[str, float], meetings: Mapping[str, int]) -> float:
        """Return how long a frame takes [s] whose companies would each take one core `work` [s], and whose cores meet so often in each."""
        n = self.core_count
        longest = max(sum(work[name] for name in names) for names in self.own)
        together = sum(work[name] / n + meetings[name] * MEETING for name in self.shared)
        return longest + together + HANDING_OUT * (n > 1)


def single(companies: Sequence[str]) -> Plan:
    """Return the plan of one core that does everything."""
    return Plan((), (tuple(companies),))


def joint(companies: Sequence[str], core_count: int) -> Plan:
    """Return the plan by which all cores share everything."""
    return Plan(tuple(companies), ((),) * core_count)


def best_plan(work: Mapping[str, float], meetings: Mapping[str, int], core_count: int) -> Plan:
    """Return the fastest of these plans: one core; or all, which share the longest companies, none to all, and divide up the rest."""
    longest = sorted(work, key=lambda name: (-work[name], name))
    worth = [name for name in longest if work[name] * (1.0 - 1.0 / core_count) > 2.0 * meetings[name] * MEETING]
    plans = [divided(work, worth[:count], core_count) for count in range(len(worth) + 1)]
    best, alone = min(plans, key=lambda plan: plan.cost(work, meetings)), single(list(work))
    return best if best.cost(work, meetings) < WORTH * alone.cost(work, meetings) else alone


def divided(work: Mapping[str, float], shared: Sequence[str], core_count: int) -> Plan:
    """Return the plan that shares some companies and gives each other one, the longest first, to the core that has least."""
    own: list[set[str]] = [set() for _ in range(core_count)]
    spent = [0.0] * core_count
    for name in sorted(set(work) - set(shared), key=lambda name: (-work[name], name)):
        least = spent.index(min(spent))
        own[least].add(name)
        spent[least] += work[name]
    in_order = [tuple(name for name in work if name in names) for names in (set(shared), *own)]
    return Plan(in_order[0], tuple(in_order[1:]))


class Measured:
    """How long companies take one core, told frame by frame, as time per element: what they have many of, they will do more of."""

    def __init__(self, companies: Sequence[str]):
        self._rates: dict[str, deque[float]] = {name: deque(maxlen=MEASURED) for name in companies}

    def told(self, name: str, seconds: float, load: int) -> None:
        """Take what one core took [s] for a company with so many elements."""
        self._rates[name].append(seconds / (load + OFFSET))

    @property
    def known(self) -> bool:
        """Whether each company was told often enough."""
        return all(len(rates) >= MEASURED for rates in self._rates.values())

    def work(self, loads: Mapping[str, int]) -> dict[str, float] | None:
        """Return how long each company would take one core [s]; None while too little is known."""
        if not all(self._rates.values()):
            return None
        work = {name: median(rates) * (loads.get(name, 0) + OFFSET) for name, rates in self._rates.items()}
        return work if self.known or sum(work.values()) > PLAIN else None
