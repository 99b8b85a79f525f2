"""Emission: how many are born, and when exactly; birth.py gives them their initial values.

A segment is a run of one emitter's births within this frame, evenly spread with jitter over part of an interval. One thread
plans them in float64.  Source: Reeves 1983 for the count law.
"""

import warp as wp

from warpsim.kernels.elementary import exp64
from warpsim.kernels.mesh_births import MeshTable
from warpsim.kernels.random import COUNT, INTERVAL, POSITION, normal, random_words, uniform64, uniform_positive
from warpsim.kernels.signals import Signals, sample_signal

UNIFORM, SCALED_UNIFORM, NORMAL, POISSON = range(4)
COUNT_LAWS = {"uniform": UNIFORM, "scaled_uniform": SCALED_UNIFORM, "normal": NORMAL, "poisson": POISSON}
VALUE_LAWS = {"uniform": UNIFORM, "normal": NORMAL}
# A population's counters, int64, on the device.
LIVE, ACTIVE, BORN = range(3)  # particles: at the frame's beginning, with those born in it, these alone
REFUSED, KILLED, NEXT_ID = range(3, 6)  # so far: births for which there was no room, particles removed beyond the world, identities given
FAULT = 6  # 1: a particle left the world, and the scene does not want it removed
CHILDREN, PUSHED, COARSE = range(7, 10)  # so far: births of events, particles put out of a collider, frames with too few substeps for one
COUNTER_COUNT = 10
MOST_BIRTHS = wp.constant(wp.float64(1.0e12))  # in one interval: what can be counted, far beyond what can be born


ADD_ONE = """
#if defined(__CUDA_ARCH__)
    atomicAdd((unsigned long long*)(counters.data + place), 1ull);
#else
    __atomic_fetch_add(counters.data + place, (wp::int64)1, __ATOMIC_RELAXED);
#endif
"""


@wp.func_native(ADD_ONE)
def count_one(place: int, counters: wp.array[wp.int64]):
    """Add 1 to a counter: wp.atomic_add is a plain sum on the CPU, where Warp knows of no second thread, and would lose some."""
    wp.atomic_add(counters, place, wp.int64(1))


@wp.struct
class Distribution:
    mean: float
    spread: float  # half width if uniform, standard deviation if normal
    law: int  # UNIFORM or NORMAL


@wp.struct
class Emitter:
    key: wp.vec2ui  # of its random numbers
    mean: int  # signal of the rate [1/s]; -1: no rate
    spread: int  # signal of the rate's spread [1/s]
    count_law: int
    interval: wp.float64  # [s]
    start: wp.float64  # [s]
    stop: wp.float64  # [s]
    shape: int  # place in SHAPES
    surface: int  # 1: on the surface only
    center: wp.vec3  # [m]
    half: wp.vec3  # box: half edges; segment: half of end − start [m]
    radius: float  # [m]
    tangent: wp.vec3  # unit vectors; a disc lies in tangent, bitangent
    bitangent: wp.vec3
    mesh: MeshTable  # empty for other shapes
    turn: wp.mat33  # of a mesh: rotation times scale [1]
    travel: wp.vec3i  # signals of its displacement [m]; -1: it stays
    direction: wp.vec3  # unit vector of the cone's axis, with two unit vectors across
    across: wp.vec3
    beyond: wp.vec3
    cone_cosine: float
    speed: Distribution  # [m/s]
    lifetime: Distribution  # [s]
    mass: Distribution  # [kg]
    extent: Distribution  # the particle's radius [m]
    colors: wp.vec2i  # its colors in the table of colors: first, count; a count of 0 is white
    log: int  # place in the table of logs of the events that it listens to; -1: none, it has a rate or bursts
    per_event: int  # births of one event
    share: float  # of the event's velocity that a child takes on [1]
    color_share: int  # 1: a child takes on the event's color
    on_surface: int  # 1: its own place and velocity are turned so that y is the surface's normal


@wp.struct
class Burst:
    emitter: int
    count: int
    at: wp.float64  # [s]
    ordinal: wp.int64  # of its first birth; bursts count apart from the rate


@wp.struct
class Segment:
    emitter: int
    begin: int  # first birth of the frame in it
    end: int
    ordinal: wp.int64  # of its first birth
    age: float  # at the frame's end, of the beginning of its first stratum [s]
    width: float  # of a stratum [s]; 0: a burst


@wp.struct
class Progress:
    interval: wp.int64  # number of the running interval
    count: wp.int64  # births of that interval, -1: not drawn yet
    done: wp.int64  # births of it that have happened
    ordinal: wp.int64  # of the interval's first birth
    carry: wp.float64  # fraction of a birth that is due


@wp.struct
class EventLog:
    count: wp.array[int]  # one number: events of this frame
    position: wp.array2d[float]  # (3, capacity of the system it happens to) [m]
    velocity: wp.array2d[float]  # (3, capacity) [m/s]
    since: wp.array[float]  # from the event to the frame's end [s]
    lineage: wp.array2d[wp.uint32]  # (2, capacity) of the particle it happens to
    number: wp.array[int]  # how many such events that particle had before
    normal: wp.array2d[float]  # (3, capacity) of the surface; empty where there is none
    tint: wp.array[wp.uint32]  # of the particle; empty where the system has no colors of its own


@wp.struct
class Births:
    emitters: wp.array[Emitter]
    bursts: wp.array[Burst]
    colors: wp.array[wp.uint32]  # rgba bytes
    logs: wp.array[EventLog]
    signals: Signals
    clock: wp.array[wp.int64]  # one number: the frame under way
    fps: wp.float64
    capacity: int


@wp.struct
class Plan:
    progress: wp.array[Progress]  # one per emitter
    segments: wp.array[Segment]
    segment_count: wp.array[int]  # one number


@wp.struct
class Particles:
    position: wp.array2d[float]  # (3, capacity) [m]
    velocity: wp.array2d[float]  # (3, capacity) [m/s]
    birth_frame: wp.array[int]  # the frame at whose step it was born
    birth_age: wp.array[float]  # its age at that frame [s]
    lifetime: wp.array[float]  # [s]
    mass: wp.array[float]  # [kg]
    radius: wp.array[float]  # [m]
    id: wp.array2d[wp.uint32]  # (2, capacity) running number of births: low word, high word
    alive: wp.array[int]  # 1 while age < lifetime; not a field, made anew each frame
    # What only some systems have; without it an array is empty.
    tint: wp.array[wp.uint32]  # color of its own, rgba bytes
    lineage: wp.array2d[wp.uint32]  # (2, capacity) random name from its emitter and ordinal: what its children's ordinals grow from
    history: wp.array2d[float]  # (3 per past value, capacity) drive of a multistep method, latest first; no rows: it needs none
    history_count: wp.array[int]  # how many of them there are
    level: wp.array[int]  # of one that chooses its substeps, log₂ of how many it takes per frame
    neighbors: wp.array[int]  # of a boid: how many others it saw
    internal: wp.array2d[float]  # (3, capacity) acceleration by the neighbors [m/s²]; not a field, made anew each substep
    contact: wp.array[int]  # number of the collider it sticks to, plus 1; 0: free
    impact: wp.array2d[float]  # (10, capacity) of the frame's first impact: place [m], velocity before [m/s], normal, time since [s]
    impact_count: wp.array[int]  # impacts so far
    impact_number: wp.array[int]  # how many there had been before the frame's first
    heading: wp.array2d[float]  # (3, capacity) unit vector toward the head of the body it belongs to [1], zero: none; not a field
    grip: wp.array[wp.vec3]  # (1): factors of friction where it slides forward, backward, sideways of that [1]


@wp.func
def draw_poisson(key: wp.vec2ui, interval: wp.int64, expected: wp.float64) -> wp.int64:
    """Return a Poisson number, by inversion in chunks of at most 16; above 1e6 by its normal limit.  Source: Devroye 1986, X.3."""
    if expected > wp.float64(1.0e6):
        words = random_words(key, interval, COUNT)
        return wp.int64(wp.floor(expected + wp.sqrt(expected) * wp.float64(normal(words[0], words[1])) + wp.float64(0.5)))
    chunks = int(wp.ceil(expected / wp.float64(16.0)))
    chunk = expected / wp.max(wp.float64(chunks), wp.float64(1.0))
    none = exp64(-chunk)
    total = wp.int64(0)
    for k in range(chunks):
        words = random_words(wp.vec2ui(key[0], key[1] + wp.uint32(k)), interval, COUNT)
        u = uniform64(words[0], words[1])
        p = none
        n = int(0)
        while u >= p and n < 200:
            u = u - p
            n = n + 1
            p = p * chunk / wp.float64(n)
        total = total + wp.int64(n)
    return total


@wp.func
def draw_count(births: Births, e: int, begin: wp.float64, end: wp.float64, progress_inout: wp.array[Progress]) -> wp.int64:
    """Draw the running interval's births N = (mean + z spread)·(end − begin) >= 0, and keep the fraction in its carry."""
    emitter = births.emitters[e]
    interval = progress_inout[e].interval
    middle = wp.float64(0.5) * (begin + end)
    mean = wp.max(sample_signal(births.signals, emitter.mean, middle), wp.float64(0.0))
    if emitter.count_law == POISSON:
        return draw_poisson(emitter.key, interval, wp.min(mean * (end - begin), MOST_BIRTHS))
    words = random_words(emitter.key, interval, INTERVAL)
    z = wp.float64(2.0) * uniform64(words[0], words[1]) - wp.float64(1.0)
    if emitter.count_law == SCALED_UNIFORM:
        z = z * wp.float64(1.7320508075688772)
    elif emitter.count_law == NORMAL:
        z = wp.float64(normal(words[0], words[1]))
    spread = sample_signal(births.signals, emitter.spread, middle)
    due = progress_inout[e].carry + wp.min(wp.max(mean + z * spread, wp.float64(0.0)) * (end - begin), MOST_BIRTHS)
    count = wp.floor(due + wp.float64(1.0e-9))  # so that 60 intervals of 1/60 s at 1/s make one birth, not none
    progress_inout[e].carry = due - count
    return wp.int64(count)


@wp.func
def births_until(emitter: Emitter, progress: Progress, fraction: wp.float64) -> wp.int64:
    """Return how many of the interval's births happen in its first fraction: birth j at (j + jitter)/count."""
    whole = wp.floor(fraction * wp.float64(progress.count))
    jitter = uniform_positive(random_words(emitter.key, progress.ordinal + wp.int64(whole), POSITION)[3])
    happened = wp.float64(jitter) <= fraction * wp.float64(progress.count) - whole
    return wp.min(progress.count, wp.int64(whole) + wp.where(happened, wp.int64(1), wp.int64(0)))


@wp.func
def append_segment(e: int, first: wp.int64, count: wp.int64, total: int, age: wp.float64, width: wp.float64, plan_inout: Plan) -> int:
    """Append a run of births and return the frame's total so far."""
    s = plan_inout.segment_count[0]
    if count <= wp.int64(0) or s >= plan_inout.segments.shape[0]:
        return total
    end = int(wp.min(wp.int64(total) + count, wp.int64(2000000000)))
    plan_inout.segments[s].emitter = e
    plan_inout.segments[s].begin = total
    plan_inout.segments[s].end = end
    plan_inout.segments[s].ordinal = first
    plan_inout.segments[s].age = float(age)
    plan_inout.segments[s].width = float(width)
    plan_inout.segment_count[0] = s + 1
    return end


@wp.func
def plan_emitter(births: Births, e: int, now: wp.float64, born: int, plan_inout: Plan) -> int:
    """Append the segments of one emitter's rate up to time now [s]; return the frame's total so far."""
    emitter = births.emitters[e]
    total = born
    while True:
        begin = emitter.start + wp.float64(plan_inout.progress[e].interval) * emitter.interval
        if begin >= now or begin >= emitter.stop:
            break
        end = wp.min(begin + emitter.interval, emitter.stop)
        if plan_inout.progress[e].count < wp.int64(0):
            plan_inout.progress[e].count = draw_count(births, e, begin, end, plan_inout.progress)
            plan_inout.progress[e].done = wp.int64(0)
        progress = plan_inout.progress[e]
        due = progress.count
        if end > now:
            due = wp.max(births_until(emitter, progress, (now - begin) / (end - begin)), progress.done)
        width = (end - begin) / wp.float64(wp.max(progress.count, wp.int64(1)))
        age = now - begin - width * wp.float64(progress.done)
        total = append_segment(e, progress.ordinal + progress.done, due - progress.done, total, age, width, plan_inout)
        plan_inout.progress[e].done = due
        if end > now:
            break
        plan_inout.progress[e].ordinal = progress.ordinal + progress.count
        plan_inout.progress[e].interval = progress.interval + wp.int64(1)
        plan_inout.progress[e].count = wp.int64(-1)
    return total


@wp.func
def plan_burst(births: Births, b: int, now: wp.float64, before: wp.float64, born: int, plan_inout: Plan) -> int:
    """Append a burst if its moment lies in (before, now] [s]; return the frame's total so far."""
    burst = births.bursts[b]
    if burst.at <= before or burst.at > now:
        return born
    return append_segment(burst.emitter, burst.ordinal, wp.int64(burst.count), born, now - burst.at, wp.float64(0.0), plan_inout)


@wp.func
def plan_children(births: Births, e: int, born: int, plan_inout: Plan) -> int:
    """Append the births of this frame's events that one emitter listens to; return the frame's total so far."""
    emitter = births.emitters[e]
    count = wp.int64(births.logs[emitter.log].count[0]) * wp.int64(emitter.per_event)
    return append_segment(e, wp.int64(0), count, born, wp.float64(0.0), wp.float64(0.0), plan_inout)


@wp.kernel(enable_backward=False)
def plan_births(first: int, births: Births, plan_inout: Plan, counters_inout: wp.array[wp.int64]):
    """One thread. Plan the frame's births; those refused for want of room consume identities too, so these ignore the capacity."""
    frame = births.clock[0]
    now = wp.float64(frame) / births.fps
    before = wp.float64(frame - wp.int64(1)) / births.fps
    plan_inout.segment_count[0] = 0
    total = int(0)
    for e in range(births.emitters.shape[0]):
        if births.emitters[e].mean >= 0:
            total = plan_emitter(births, e, now, total, plan_inout)
    for b in range(births.bursts.shape[0]):
        total = plan_burst(births, b, now, before, total, plan_inout)
    childless = total
    for e in range(births.emitters.shape[0]):
        if births.emitters[e].log >= 0:
            total = plan_children(births, e, total, plan_inout)
    born = wp.min(wp.int64(total), wp.int64(births.capacity) - counters_inout[LIVE])
    counters_inout[CHILDREN] = counters_inout[CHILDREN] + wp.max(born - wp.int64(childless), wp.int64(0))
    counters_inout[BORN] = born
    counters_inout[ACTIVE] = counters_inout[LIVE] + born
    counters_inout[REFUSED] = counters_inout[REFUSED] + wp.int64(total) - born
    counters_inout[NEXT_ID] = counters_inout[NEXT_ID] + wp.int64(total)
