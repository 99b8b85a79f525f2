"""Removal on the CPU while the particles are in a core's cache: chunk by chunk, right after they have moved (docs/adr/0036-particles.md).

Cores take chunks in turn. Each closes the gaps within its chunk, waits until the chunks before it have been put where they belong, and puts
its own behind them. So every row goes through memory once per frame, in order of birth, whoever has which chunk.
"""

import warp as wp

from warpsim.kernels.crew import LINE, spelled
from warpsim.kernels.emission import LIVE
from warpsim.kernels.snippets import BLOCK

NEXT, WRITTEN = 0, LINE  # words of a relay: whose turn it is, and how far those before have come; between frames 0
RELAY = 2 * LINE
MOST_BLOCKS = 64  # in a chunk: all its rows stay in the second-level cache


@wp.func
def chunk_size(count: int, part_count: int) -> int:
    """Return how many particles are in a chunk: some chunks for each core, if there are enough."""
    blocks = (count + BLOCK - 1) // BLOCK
    return BLOCK * wp.clamp((blocks + 4 * part_count - 1) // (4 * part_count), 1, MOST_BLOCKS)


CLOSE_RANKS = """
    typedef wp::int32 lanes __attribute__((vector_size(64), aligned(4), may_alias));
    const wp::int32* keep = alive.data;
    wp::int32 *next = relay.data + @NEXT@, *written = relay.data + @WRITTEN@, *abandoned = barrier.data + @ABANDONED@;
    const int n = end - begin, start = part_count == 1 ? *written : begin;  // alone it need not wait to know where all belong
    int w = start;
    bool gaps = start != begin;
    for (int i = begin; i < end; ++i) { gaps |= !keep[i]; w += keep[i]; }
    const int count = w - start;
    if (gaps) {
    #if defined(__AVX512F__)
        typedef bool bits __attribute__((ext_vector_type(16)));
        unsigned short kept[@BLOCK@ * @MOST_BLOCKS@ / 16];
        w = start;
        for (int k = 0; 16 * k < n; ++k) {  // a store of all lanes ends before what is not read yet
            const bits there = __builtin_convertvector(*(const lanes*)(keep + begin + 16 * k) != 0, bits);
            kept[k] = __builtin_bit_cast(unsigned short, there) & (n - 16 * k < 16 ? (1 << (n - 16 * k)) - 1 : 0xffff);
        }
        for (int row = 0; row < slab.shape[0]; ++row) {
            wp::int32* r = (wp::int32*)slab.data + (size_t)slab.shape[1] * row;
            w = start;
            for (int k = 0; 16 * k < n; ++k) {
                const lanes v = *(const lanes*)(r + begin + 16 * k);
                *(lanes*)(r + w) = __builtin_ia32_compresssi512_mask(v, v, kept[k]);
                w += __builtin_popcount(kept[k]);
            }
        }
    #else
        for (int row = 0; row < slab.shape[0]; row += 4) {
            wp::uint32* r[4];
            for (int k = 0; k < 4; ++k) r[k] = slab.data + (size_t)slab.shape[1] * (row + k < slab.shape[0] ? row + k : slab.shape[0] - 1);
            wp::uint32 *a = r[0], *b = r[1], *c = r[2], *d = r[3];
            w = start;
            for (int i = begin; i < end; ++i) { a[w] = a[i]; b[w] = b[i]; c[w] = c[i]; d[w] = d[i]; w += keep[i]; }
        }
    #endif
    }
    int to = start;
    if (part_count > 1) {
        for (int spin = 0; __atomic_load_n(next, __ATOMIC_ACQUIRE) != chunk && !__atomic_load_n(abandoned, __ATOMIC_RELAXED); ++spin) {
            if (spin >= 1000) { TURN } else { REST }
        }
        to = *written;
        if (to != begin) for (int row = 0; row < slab.shape[0]; ++row) {
            wp::int32* r = (wp::int32*)slab.data + (size_t)slab.shape[1] * row;
            for (int i = 0; i < count; i += 16) *(lanes*)(r + to + i) = *(const lanes*)(r + begin + i);
        }
    }
    const bool last = end == active;
    if (last) counters.data[@LIVE@] = (wp::int64)(to + count);
    *written = last ? 0 : to + count;
    __atomic_store_n(next, last ? 0 : chunk + 1, __ATOMIC_RELEASE);
"""
CLOSE_RANKS = CLOSE_RANKS.replace("@NEXT@", str(NEXT)).replace("@WRITTEN@", str(WRITTEN)).replace("@MOST_BLOCKS@", str(MOST_BLOCKS))


@wp.func_native(spelled(CLOSE_RANKS))
def close_ranks(
    chunk: int,
    begin: int,
    end: int,
    active: int,
    part_count: int,
    alive: wp.array[int],
    counters: wp.array[wp.int64],
    slab: wp.array2d[wp.uint32],
    relay: wp.array[int],
    calls: wp.uint64,
    barrier: wp.array[int],
):
    """Put the survivors of a chunk, all their rows, behind those of the chunks before; who has the last one counts them."""
    w = relay[WRITTEN]
    for i in range(begin, end):
        for row in range(slab.shape[0]):
            slab[row, w] = slab[row, i]
        w = w + alive[i]
    relay[NEXT] = chunk + 1
    relay[WRITTEN] = w
    if end == active:
        counters[LIVE] = wp.int64(w)
        relay[NEXT] = 0
        relay[WRITTEN] = 0
