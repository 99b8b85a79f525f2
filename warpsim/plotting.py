"""Plots, through matplotlib (the extra `plot`), which is imported with this module and nowhere else."""

import io
import math
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from warpsim.files import whole_file

COLORS = ("#e03131", "#e8890c", "#2b8a3e", "#1971c2", "#7048e8", "#0c8599", "#c2255c", "#5c940d", "#495057", "#a61e4d", "#1864ab")
MARKS = "osD^v<>Pp*h"


def draw_study(study, path: Path, title: str) -> None:
    """Draw errors over steps on logarithmic axes: 64 bit in full lines, 32 bit in thin dashes, beside them the slopes of the orders.

    The file appears whole. Raises OSError.
    """
    figure = Figure(figsize=(9.6, 6.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for number, method in enumerate(study.methods):
        color, mark = COLORS[number % len(COLORS)], MARKS[number % len(MARKS)]
        order = "" if method.order is None else f"  {method.order:.2f}"
        axes.loglog(
            study.steps, _shown(method.errors), color=color, marker=mark, markersize=4.5, linewidth=1.6, label=method.solver + order
        )
        axes.loglog(study.steps, _shown(method.errors32), color=color, linewidth=0.8, linestyle=(0, (4, 3)), alpha=0.65)
    _draw_slopes(axes, study)
    axes.set_xlabel("step [s]")
    axes.set_ylabel("largest distance from the exact path [m]")
    axes.set_title(f"{title}: {study.system} ({study.form} form)", loc="left", fontsize=11)
    axes.grid(True, which="major", color="#dee2e6", linewidth=0.7)
    axes.spines[["top", "right"]].set_visible(False)
    axes.plot([], [], color="#868e96", linewidth=0.8, linestyle=(0, (4, 3)), label="32 bit")
    axes.legend(title="method, measured order", frameon=False, fontsize=9, title_fontsize=9, loc="center left", bbox_to_anchor=(1.0, 0.5))
    picture = io.BytesIO()
    figure.savefig(picture, format=path.suffix.removeprefix(".").lower())
    with whole_file(path) as file:
        file.write(picture.getvalue())


def _shown(errors) -> list[float]:
    """Return errors that a logarithmic axis can show: none that is zero or infinite."""
    return [error if 0.0 < error < 1e6 else math.nan for error in errors]


def _draw_slopes(axes, study) -> None:
    """Draw short lines of the methods' orders as a gauge, from one point below the largest steps."""
    errors = [error for method in study.methods for error in _shown(method.errors) if not math.isnan(error)]
    if not errors:
        return
    axes.set_ylim(0.1 * min(errors), 4.0 * min(max(errors), 1e3))
    right, left, low = study.steps[0], study.steps[1], 0.3 * min(errors)
    for order in sorted({method.theory for method in study.methods}):
        high, place = low * (right / left) ** order, {"ha": "left", "va": "center", "textcoords": "offset points"}
        axes.loglog([left, right], [low, high], color="#adb5bd", linewidth=1.0)
        axes.annotate(str(order), (right, high), color="#868e96", fontsize=8, xytext=(4, 0), **place)
