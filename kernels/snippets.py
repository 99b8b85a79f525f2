"""What native loops are written with: texts in which formulas are named, and how the particles are cut among cores."""

import warp as wp

from warpsim.kernels.emission import FAULT, KILLED, LIVE
from warpsim.kernels.environment import KILL
from warpsim.kernels.flow import FLOWS

BLOCK = 64  # particles that stay in the first-level cache through all substeps; a population's capacity is a multiple of it
PLACES = {"FAULT": FAULT, "KILLED": KILLED, "LIVE": LIVE, "KILL": KILL, "BLOCK": BLOCK, "UNIFORM": list(FLOWS).index("uniform")}


def snippet(text: str, *formulas) -> str:
    """Put the formulas' generated C++ names and the counters' places into the text."""
    for formula in formulas:
        text = text.replace(f"${formula.func.__name__}(", f"{formula.native_func}(")
    for name, place in PLACES.items():
        text = text.replace(f"@{name}@", str(place))
    return f"#if !defined(__CUDA_ARCH__)\n    typedef wp::vec_t<3, float> vec;{text}\n#endif\n"


@wp.func
def share(part: int, part_count: int, count: int) -> wp.vec2i:
    """Return the elements [begin, end) of one core's part, cut between blocks."""
    blocks = (count + BLOCK - 1) // BLOCK
    return wp.vec2i(BLOCK * (blocks * part // part_count), wp.min(count, BLOCK * (blocks * (part + 1) // part_count)))
