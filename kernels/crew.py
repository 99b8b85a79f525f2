"""The crew on the CPU: how threads wait for an order, replay their parts of a frame side by side, and meet between its stages.

All of it is native, so that nobody needs Python's interpreter lock before the frame is done, and for the CPU only; the functions have no
plain body. The words of `calls` are addresses of functions, 0 where the system has none.
"""

import warp as wp

from warpsim.kernels.snippets import snippet

LINE = 16  # ints to a cache line, so that words that different cores write are apart
ROUND, FINISHED, AWAITED, LEADER_SLEEPS, QUIT, OPENS, UNDER_WAY = (LINE * k for k in range(7))  # words of the board
BOARD = LINE * 7
# Words of an order: the round that it is for; of one that is done [ns] at work, and [ns] in all; whether a thread takes such orders, and
# sleeps until there is one.
GIVEN, STATE, MEETING, NUMBER, FAILED, WORKED, TAKEN, HIRED, SLEEPS = range(9)
ORDER = 16  # two cache lines
REPLAY, GIVE_WAY, SLEEP, WAKE, CLOCK, GET_PLACE, SET_PLACE = range(7)  # addresses
CALLS = 7
ABANDONED = 2 * LINE  # the word of a barrier that a failing core sets
BARRIER = 3 * LINE

PREAMBLE = """
    typedef wp::uint64 word;
    #define CALL ((const word*)calls)
    typedef bool (*replaying)(word);
    typedef void (*yielding)();  // int(*)() would meet Warp's macro int(x)
    typedef wp::int32 (*placing)(wp::int32, word, void*);
    #if defined(_WIN32)  // timespec_get: the clock on the wall for both
    typedef wp::int32 (*reading)(wp::int64*, wp::int32);
    #define NOW(kind, span) if (CALL[@CLOCK@]) ((reading)CALL[@CLOCK@])(span, 1);
    #else
    typedef wp::int32 (*reading)(wp::int32, wp::int64*);
    #define NOW(kind, span) if (CALL[@CLOCK@]) ((reading)CALL[@CLOCK@])(kind, span);
    #endif
    #if defined(_WIN32)
    typedef wp::int32 (*sleeping)(wp::int32*, wp::int32*, word, wp::uint32);
    typedef void (*waking)(wp::int32*);
    #define SLEEP_ON(place, value, ms) if (CALL[@SLEEP@]) { wp::int32 same = value; \\
        ((sleeping)CALL[@SLEEP@])(place, &same, 4, ms); }
    #define WAKE_ALL(place) if (CALL[@WAKE@]) ((waking)CALL[@WAKE@])(place);
    #elif defined(__linux__)
    typedef wp::int64 (*system_call)(wp::int64, ...);
    #if defined(__x86_64__)
    #define FUTEX 202L
    #else
    #define FUTEX 98L
    #endif
    #define SLEEP_ON(place, value, ms) if (CALL[@SLEEP@]) { wp::int64 span[2] = { (ms) / 1000, (ms) % 1000 * 1000000L }; \\
        ((system_call)CALL[@SLEEP@])(FUTEX, place, 128L, (wp::int64)(value), span, 0L, 0L); }
    #define WAKE_ALL(place) if (CALL[@WAKE@]) ((system_call)CALL[@WAKE@])(FUTEX, place, 129L, 0x7fffffffL, 0L, 0L, 0L);
    #else
    typedef wp::int32 (*dozing)(wp::uint32);
    #define SLEEP_ON(place, value, ms) if (CALL[@SLEEP@]) ((dozing)CALL[@SLEEP@])(200);
    #define WAKE_ALL(place)
    #endif
    #if defined(__x86_64__)
    #define REST __builtin_ia32_pause();
    #elif defined(__aarch64__)
    #define REST __asm__ volatile("yield");
    #else
    #define REST
    #endif
    #define TURN if (CALL[@GIVE_WAY@]) ((yielding)CALL[@GIVE_WAY@])(); else { REST }
    #if defined(__APPLE__)
    #define OWN_TIME 16
    #define ALL_TIME 6
    #else
    #define OWN_TIME 3
    #define ALL_TIME 1
    #endif
    #define CARRY_OUT(order) { wp::int64 worked[4] = {}, taken[4] = {}; NOW(ALL_TIME, taken) NOW(OWN_TIME, worked) \\
        if (!((replaying)CALL[@REPLAY@])(order[@STATE@])) { \\
            order[@FAILED@] = 1; __atomic_store_n((wp::int32*)order[@MEETING@] + @ABANDONED@, 1, __ATOMIC_RELEASE); } \\
        NOW(OWN_TIME, worked + 2) NOW(ALL_TIME, taken + 2) \\
        order[@WORKED@] = (word)(1000000000LL * (worked[2] - worked[0]) + worked[3] - worked[1]); \\
        order[@TAKEN@] = (word)(1000000000LL * (taken[2] - taken[0]) + taken[3] - taken[1]); }
"""

NAMES = """ROUND FINISHED AWAITED LEADER_SLEEPS QUIT OPENS UNDER_WAY GIVEN STATE MEETING NUMBER FAILED WORKED TAKEN HIRED SLEEPS
ORDER ABANDONED REPLAY GIVE_WAY SLEEP WAKE CLOCK GET_PLACE SET_PLACE"""
MACROS = "CALL SLEEP_ON WAKE_ALL FUTEX REST TURN OWN_TIME ALL_TIME NOW CARRY_OUT"


def spelled(text: str) -> str:
    """Return a snippet with the names of words replaced by their places, and with the macros that all of them use."""
    text = PREAMBLE + text + "".join(f"    #undef {name}\n" for name in MACROS.split())
    for name in NAMES.split():
        text = text.replace(f"@{name}@", str(globals()[name]))
    return snippet(text)


LEAD = """
    wp::int32* b = board.data;
    word* order = orders.data;
    if (b[@OPENS@]) {
        b[@OPENS@] = b[@FINISHED@] = 0;
        b[@UNDER_WAY@] = 1;
        const wp::int32 now = b[@ROUND@] + 1;
        __atomic_store_n(b + @ROUND@, now, __ATOMIC_RELAXED);
        for (int k = 1; k < orders.shape[0]; ++k) {  // whom it is not about sleeps on: awake it would want a core that is taken
            word* its = orders.data + k * @ORDER@;
            if (!its[@GIVEN@] && !(b[@QUIT@] && its[@HIRED@])) continue;
            __atomic_store_n((wp::int32*)(its + @NUMBER@), now, __ATOMIC_SEQ_CST);
            if (__atomic_load_n(its + @SLEEPS@, __ATOMIC_SEQ_CST)) { WAKE_ALL((wp::int32*)(its + @NUMBER@)) }
        }
        if (order[@GIVEN@]) {
            wp::uint64 home[16] = {};
            bool moved = ((word*)place)[0] && CALL[@GET_PLACE@] && ((placing)CALL[@GET_PLACE@])(0, 128, home) >= 0;
            moved = moved && !((placing)CALL[@SET_PLACE@])(0, 128, (word*)place + 1);
            CARRY_OUT(order)
            if (moved) ((placing)CALL[@SET_PLACE@])(0, 128, home);
            for (int turn = 0; turn < 2100 && __atomic_load_n(b + @FINISHED@, __ATOMIC_ACQUIRE) != b[@AWAITED@]; ++turn) {
                if (turn < 2000) { REST } else { TURN }
            }
        }
    }
    __atomic_store_n(b + @LEADER_SLEEPS@, 1, __ATOMIC_SEQ_CST);
    for (int turn = 0; turn < b[@AWAITED@] + 1; ++turn) {  // each that finishes may wake it for nothing
        const wp::int32 finished = __atomic_load_n(b + @FINISHED@, __ATOMIC_SEQ_CST);
        if (finished == b[@AWAITED@]) { b[@UNDER_WAY@] = 0; break; }
        SLEEP_ON(b + @FINISHED@, finished, 50)
    }
    __atomic_store_n(b + @LEADER_SLEEPS@, 0, __ATOMIC_SEQ_CST);
"""


@wp.func_native(spelled(LEAD))
def open_round(board: wp.array[int], orders: wp.array2d[wp.uint64], place: wp.uint64, calls: wp.uint64):
    """Open a round, carry out the leader's own order, if there is one, on the core that `place` says, and wait a while for the others."""
    ...


FOLLOW = """
    wp::int32* b = board.data;
    word* order = orders.data + part * @ORDER@;
    wp::int32* number = (wp::int32*)(order + @NUMBER@);
    wp::int32 seen = __atomic_load_n(number, __ATOMIC_ACQUIRE);
    const bool second = __atomic_exchange_n(order + @HIRED@, (word)1, __ATOMIC_ACQ_REL);
    while (!second) {
        wp::int32 now = seen;
        for (int turn = 0; turn < 2100 && now == seen; ++turn) {
            if (turn < 2000) { REST } else { TURN }
            now = __atomic_load_n(number, __ATOMIC_ACQUIRE);
        }
        if (now == seen) {
            __atomic_store_n(order + @SLEEPS@, (word)1, __ATOMIC_SEQ_CST);
            while ((now = __atomic_load_n(number, __ATOMIC_SEQ_CST)) == seen) { SLEEP_ON(number, seen, 1000) }
            __atomic_store_n(order + @SLEEPS@, (word)0, __ATOMIC_SEQ_CST);
        }
        seen = now;
        if (b[@QUIT@]) break;
        CARRY_OUT(order)
        if (__atomic_add_fetch(b + @FINISHED@, 1, __ATOMIC_SEQ_CST) == b[@AWAITED@]
            && __atomic_load_n(b + @LEADER_SLEEPS@, __ATOMIC_SEQ_CST)) { WAKE_ALL(b + @FINISHED@) }
    }
"""


@wp.func_native(spelled(FOLLOW))
def serve_rounds(part: int, board: wp.array[int], orders: wp.array2d[wp.uint64], calls: wp.uint64):
    """Carry out the orders of round after round: look for a while after each, then sleep; until told to quit, or if another does."""
    ...


BARRIER_TEXT = """
    int *arrived = barrier.data, *round = arrived + 16, *abandoned = arrived + @ABANDONED@;  // a cache line each
    const int now = __atomic_load_n(round, __ATOMIC_ACQUIRE);
    if (__atomic_add_fetch(arrived, 1, __ATOMIC_ACQ_REL) == part_count) {
        __atomic_store_n(arrived, 0, __ATOMIC_RELAXED);
        __atomic_store_n(round, now + 1, __ATOMIC_RELEASE);
    } else for (int spin = 0; __atomic_load_n(round, __ATOMIC_ACQUIRE) == now && !__atomic_load_n(abandoned, __ATOMIC_RELAXED); ++spin) {
        if (spin >= 1000) { TURN } else { REST }
    }
"""


@wp.func_native(spelled(BARRIER_TEXT))
def wait_for_all(part_count: int, calls: wp.uint64, barrier: wp.array[int]):
    """Spin, then yield to other threads, until every part has arrived."""
    ...


@wp.kernel(enable_backward=False)
def lead_round(first: int, board_inout: wp.array[int], orders_inout: wp.array2d[wp.uint64], place: wp.uint64, calls: wp.uint64):
    """Open a round and take part in it, or wait on for one that is open."""
    open_round(board_inout, orders_inout, place, calls)


@wp.kernel(enable_backward=False)
def follow_rounds(part: int, part_count: int, board_inout: wp.array[int], orders_inout: wp.array2d[wp.uint64], calls: wp.uint64):
    """Be a thread of the crew until told to quit."""
    serve_rounds(part, board_inout, orders_inout, calls)


@wp.kernel(enable_backward=False)
def resolve_barrier(part_count: int, calls: wp.uint64, barrier_inout: wp.array[int]):
    """Wait for the other cores: a node of a captured graph."""
    wait_for_all(part_count, calls, barrier_inout)


NOTE = """
    wp::int64 span[2] = {};
    NOW(OWN_TIME, span)
    times.data[row * 2 + column] = 1000000000LL * span[0] + span[1];
"""


@wp.func_native(spelled(NOTE))
def store_time(row: int, column: int, calls: wp.uint64, times: wp.array2d[wp.int64]):
    """Store the time that the present thread has had a core [ns]."""
    ...


@wp.kernel(enable_backward=False)
def note_time(first: int, row: int, column: int, calls: wp.uint64, times_inout: wp.array2d[wp.int64]):
    """Note how long the present thread has had a core [ns]: a node of a captured graph."""
    store_time(row, column, calls, times_inout)
