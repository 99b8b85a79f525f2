"""Tables: drawn by rich on a terminal, plain columns into a pipe."""

import sys
from collections.abc import Sequence

COLORS = {"PASS": "green", "FAIL": "bold red", "SKIPPED": "yellow", "UNMEASURED": "bold red"}


def print_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print rows of text under their heads; words like PASS are colored on a terminal."""
    if sys.stdout.isatty():
        from rich.console import Console
        from rich.markup import escape
        from rich.table import Table

        table = Table(*heads)
        for row in rows:
            table.add_row(*(f"[{COLORS[cell]}]{cell}[/]" if cell in COLORS else escape(cell) for cell in row))
        Console().print(table)
        return
    widths = [max(len(row[k]) for row in (heads, *rows)) for k in range(len(heads))]
    for row in (heads, *rows):
        print("  " + "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())
