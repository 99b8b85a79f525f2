"""What the measurements say, as one table for people and JSON lines for programs."""

import json
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.measure import MOST_SPREAD, Sample


@dataclass
class Report:
    """Rows as they come in; every row is one JSON object."""

    console: Console
    rows: list[dict] = field(default_factory=list)

    def figures(self, case: str, what: str, header: list[str], lines: list[tuple[list[str], dict]]) -> None:
        """Print a table of a case and keep its rows."""
        table = Table(title=what, title_justify="left", header_style="bold")
        for column, name in enumerate(header):
            table.add_column(name, justify="left" if column == 0 else "right")
        for cells, row in lines:
            table.add_row(*cells)
            self.rows.append({"case": case, **row})
        self.console.print(table)

    def ratio(self, case: str, label: str, sample: Sample, bar: float | None = None, starved: bool = False) -> None:
        """Print a ratio with its spread; one that scatters too much, or was taken on borrowed cores, is not called a result."""
        settled = sample.settled and not starved
        row = {"case": case, "ratio": label, "value": sample.median, "spread": sample.spread, "settled": settled, "bar": bar}
        self.rows.append(row)
        if starved:
            text = f"no result: other work took cores meanwhile (median {sample.median:.1f}x)"
        elif not settled:
            text = f"no result: spread {sample.spread:.0%} > {MOST_SPREAD:.0%} (median {sample.median:.1f}x)"
        else:
            text = f"{sample.median:.1f}x, spread {sample.spread:.0%}" + (f", to reach: {bar:g}x" if bar else "")
        self.console.print(f"{label}: {text}")

    def fact(self, case: str, label: str, text: str, **row) -> None:
        """Print one line and keep its numbers."""
        self.rows.append({"case": case, "fact": label, **row})
        self.console.print(f"{label}: {text}")

    def write(self, path: Path) -> None:
        """Write the rows as JSON lines."""
        path.write_text("".join(json.dumps(row) + "\n" for row in self.rows))
