"""The picture of scaling: what one costs among a thousand and among ten million; ours in blue, peers beside, the machine's limit dashed."""

import re
from pathlib import Path

import numpy as np

from benchmarks.report import number

TITLES = {"scaling-particles": "Particles", "scaling-flocks": "Boids", "scaling-cloth": "Cloth"}
ITEMS = {"scaling-particles": "particle", "scaling-flocks": "boid", "scaling-cloth": "vertex"}
INK, FAINT = "#343a40", "#868e96"
ONE, ALL = "#74a9d8", "#1864ab"
PEERS = {"Numba": "#e8590c", "Taichi": "#9c6b30", "Warp": "#868e96"}
UNITS = ((1e6, "M"), (1e3, "k"), (1e-9, ""))
IN_SIGHT = 0.2  # of our cost: a limit farther down would only press the lines together
WIDTH, HEIGHT = 4.6, 4.0  # of a panel, inches


def style_of(way: str, several: bool) -> dict:
    """Return how a way's line looks; `several`: there is one of ours for more than one core."""
    if way.startswith("warpsim"):
        every = way != "warpsim, 1 core" or not several
        return {"color": ALL if every else ONE, "linewidth": 2.4 if every else 1.5, "zorder": 5 if every else 4}
    return {"color": next((color for name, color in PEERS.items() if way.startswith(name)), FAINT), "linewidth": 1.5, "zorder": 3}


def short(way: str) -> str:
    """Return a way's name as it stands at its line's end; peers have all cores there unless it says one."""
    return re.sub(r", (?!1 )\d+ threads$", "", way).replace("warpsim, ", "warpsim ")


def curves_of(rows: list[dict]) -> dict[str, dict[str, list[dict]]]:
    """Return the points of each curve by row and way."""
    found: dict[str, dict[str, list[dict]]] = {}
    for row in rows:
        if row["kind"] == "point":
            found.setdefault(row["row"], {}).setdefault(row["way"], []).append(row)
    return found


def draw_scaling(rows: list[dict], path: Path) -> bool:
    """Draw what there is of the three curves; return whether there was anything. Raises ImportError without matplotlib."""
    from matplotlib.figure import Figure

    curves = {name: ways for name, ways in curves_of(rows).items() if name in TITLES}
    if not curves:
        return False
    bounds = {row["row"]: row["bytes_each"] / row["copy_gb_per_s"] for row in rows if row["kind"] == "note" and "bytes_each" in row}
    figure = Figure(figsize=(WIDTH * len(curves), HEIGHT), layout="constrained")
    figure.get_layout_engine().set(wspace=0.06, w_pad=0.08, h_pad=0.08)
    panels = figure.subplots(1, len(curves), squeeze=False)[0]
    ends = [draw_panel(panel, ways, bounds.get(name)) for panel, (name, ways) in zip(panels, curves.items(), strict=True)]
    span = max(np.ptp(np.log10(panel.get_ylim())) for panel in panels)
    for panel, name, names in zip(panels, curves, ends, strict=True):
        middle = np.log10(panel.get_ylim()).mean()
        panel.set_ylim(10.0 ** (middle - 0.5 * span), 10.0 ** (middle + 0.5 * span))  # so that slopes can be compared
        write_names(panel, names)
        finish_panel(panel, name)
    figure.savefig(path, dpi=150, facecolor="white")
    return True


def draw_panel(panel, ways: dict[str, list[dict]], bound: float | None) -> list[tuple]:
    """Draw the curves of one kind of work; return at which cost which name ends which line."""
    several = any(way.startswith("warpsim") and way != "warpsim, 1 core" for way in ways)
    ends = []
    for way, points in ways.items():
        style = style_of(way, several)
        counts, costs = (np.array([point[key] for point in points], float) for key in ("count", "ns"))
        low, high = np.array([point["quartiles_ns"] for point in points]).T
        panel.fill_between(counts, low, high, color=style["color"], alpha=0.15, linewidth=0)
        panel.plot(counts, costs, **style, solid_capstyle="round")
        for settled, face in ((True, style["color"]), (False, "white")):
            chosen = np.array([point["settled"] == settled for point in points])
            look = {"markersize": 4.0, "markerfacecolor": face, "markeredgecolor": style["color"], "zorder": style["zorder"] + 3}
            panel.plot(counts[chosen], costs[chosen], "o", **look)
        ends.append((costs[-1], f"{short(way)}  {number(costs[-1])}", style))
    panel.set_xscale("log")
    panel.set_yscale("log")
    if bound and bound > IN_SIGHT * min(end[0] for end in ends):
        panel.axhline(bound, color=FAINT, linewidth=1.0, linestyle=(0, (4, 3)), zorder=1)
        ends.append((bound, f"state copied once  {number(bound)}", {"color": FAINT, "linewidth": 1.0}))
    return ends


def write_names(panel, ends: list[tuple]) -> None:
    """Write names and last figures to the right of the lines, as far apart as letters are high."""
    low, high = np.log10(panel.get_ylim())
    step, place = 0.052 * (high - low), -np.inf
    for cost, text, style in sorted(ends, key=lambda end: end[0]):
        place = max(np.log10(cost), place + step)
        weight = "bold" if style["linewidth"] > 2.0 else "normal"
        at = {"xy": (1.02, 10.0**place), "xycoords": ("axes fraction", "data"), "annotation_clip": False}
        panel.annotate(text, **at, color=style["color"], fontsize=8.5, fontweight=weight, ha="left", va="center")


def finish_panel(panel, name: str) -> None:
    """Make axes that can be read."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    panel.set_title(TITLES[name], loc="left", color=INK, fontsize=12, fontweight="bold", pad=22)
    panel.text(0.0, 1.03, f"ns per {ITEMS[name]} and frame", transform=panel.transAxes, color=FAINT, fontsize=9)
    panel.yaxis.set_major_locator(LogLocator(base=10.0, subs=(1.0, 2.0, 5.0)))
    panel.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: next(f"{value / k:g} {u}" for k, u in UNITS if value >= k)))
    for axis in (panel.xaxis, panel.yaxis):
        axis.set_minor_formatter(NullFormatter())
    panel.grid(True, which="major", axis="y", color="#e9ecef", linewidth=0.8, zorder=0)
    panel.tick_params(which="both", colors=FAINT, labelsize=9, length=0)
    panel.tick_params(which="major", axis="x", length=3)
    for side in ("top", "right", "left"):
        panel.spines[side].set_visible(False)
    panel.spines["bottom"].set_color("#ced4da")
