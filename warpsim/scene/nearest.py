"""Did-you-mean: the allowed word that is nearest to a misspelled one."""

from collections.abc import Iterable

# What other programs call it. Used only where the word on the right is allowed and nothing is spelled nearly like the word on the left.
OTHER_WORDS = {
    "position": ("center",),
    "origin": ("center",),
    "location": ("center",),
    "pos": ("center",),
    "acceleration": ("gravity",),
    "g": ("gravity",),
    "wind": ("flow", "uniform"),
    "flows": ("flow",),
    "fields": ("flow", "forces"),
    "particle_count": ("capacity",),
    "max_particles": ("capacity",),
    "count": ("capacity", "rate"),
    "amount": ("rate", "capacity"),
    "integrator": ("solver",),
    "method": ("solver",),
    "drag": ("coupling", "alpha"),
    "angle": ("cone",),
    "spread": ("cone",),
    "life": ("lifetime",),
    "lifespan": ("lifetime",),
    "ttl": ("lifetime",),
    "framerate": ("fps",),
    "frame_rate": ("fps",),
    "steps": ("substeps",),
    "length": ("duration",),
    "time_end": ("duration",),
    "look_at": ("target",),
    "fov": ("field_of_view",),
    "gamma": ("circulation",),
    "omega": ("angular_velocity",),
    "sink": ("source",),
    "circle": ("disc",),
    "disk": ("disc",),
    "ball": ("sphere",),
    "cube": ("box",),
    "line": ("segment",),
    "gaussian": ("normal",),
    "gauss": ("normal",),
    "random": ("rand", "uniform"),
    "midpoint": ("rk4",),
    "leapfrog": ("verlet",),
    "runge_kutta": ("rk4",),
    "symplectic_euler": ("semi_implicit_euler",),
    "explicit_euler": ("euler",),
    "add": ("additive",),
    "opacity": ("color",),
    "transparency": ("color",),
    "from": ("start",),
    "to": ("end", "stop"),
}


def _plain(word: str) -> str:
    return word.lower().replace("-", "_").replace(" ", "_").strip("_:")


def edit_distance(a: str, b: str) -> int:
    """Count the edits between two words: a letter more, less or other, or two neighbors swapped."""
    before, row = [], list(range(len(b) + 1))
    for i, letter in enumerate(a, 1):
        earlier, before, row = before, row, [i]
        for j, other in enumerate(b, 1):
            best = min(before[j] + 1, row[j - 1] + 1, before[j - 1] + (letter != other))
            if i > 1 and j > 1 and letter == b[j - 2] and a[i - 2] == other:
                best = min(best, earlier[j - 2] + 1)
            row.append(best)
    return row[-1]


def likeness(word: str, candidate: str) -> float:
    """Return how alike two words are, from 0 (nothing in common) to 1 (equal but for case and hyphens)."""
    a, b = _plain(word), _plain(candidate)
    if not a or not b:
        return 0.0
    shorter, longer = sorted((a, b), key=len)
    # The lengths alone may tell that they differ by too much to be worth a closer look.
    score = 1.0 - edit_distance(a, b) / len(longer) if len(longer) - len(shorter) <= 0.6 * len(longer) else 0.0
    if len(shorter) >= 3 and longer.startswith(shorter):
        # "vel" for velocity, "velocities" for velocity
        score = max(score, 0.7 + 0.25 * len(shorter) / len(longer))
    elif len(shorter) >= 4 and (longer.endswith(shorter) or shorter in longer.split("_")):
        score = max(score, 0.65)
    return score


def listed(words: Iterable[str], most: int = 24) -> str:
    """Return words separated by commas, cut where there are very many."""
    words = list(words)
    return ", ".join(words[:most]) + (", …" if len(words) > most else "")


def nearest(word: str, allowed: Iterable[str]) -> str | None:
    """Return the allowed word that was most likely meant, or None when nothing is near."""
    allowed = list(allowed)
    word = word[:80]
    best = max(allowed, key=lambda candidate: likeness(word, candidate), default=None)
    least = 0.5 if len(word) <= 4 else 0.58
    if best is not None and likeness(word, best) >= least:
        return best
    return next((other for other in OTHER_WORDS.get(_plain(word), ()) if other in allowed), None)
