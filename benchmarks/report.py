"""What the measurements say: lines for people as they come in, one table of all claims at the end, JSON lines for programs."""

import json
from dataclasses import dataclass, field
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.measure import MOST_SPREAD, Sample, Timing, Way

REACHED, MISSED, NO_RESULT = "reached", "missed", "no result"


def number(value: float) -> str:
    """Return three figures of a number, as people write it."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:,.0f}"


@dataclass
class Report:
    """Rows as they come in; every row is one JSON object."""

    console: Console
    rows: list[dict] = field(default_factory=list)

    def begin(self, name: str, work: str) -> None:
        """Head a contest."""
        self._keep(name, "work", f"[bold]{name}[/bold]: {work}", work=work)

    def missing(self, name: str, peer: str, package: str) -> None:
        """Tell of a peer that is not there."""
        self._keep(name, "missing", f"  {peer}: not installed (pip install {package}, or the extra bench)", peer=peer, package=package)

    def states(self, name: str, hashes: dict[str, str], apart: dict[str, float], most: float, unit: str, why: str) -> None:
        """Tell of the states in which the turns begin."""
        equal = len(set(hashes.values())) == 1
        text = f"  state hashes {'equal' if equal else 'DIFFER'}: {', '.join(hashes)}"
        for label, distance in apart.items():
            text += f"\n  {label}: {distance:.1e} {unit} from ours, at most {most:.1e} ({why})"
            text += "" if distance <= most else "; STATES DIFFER, not timed"
        self._keep(name, "states", text, equal=equal, hashes=hashes, apart=apart, most=most, unit=unit, why=why)

    def end_states(self, name: str, hashes: dict[str, str], frame: int) -> None:
        """Tell of the state in which the turns end."""
        equal = len(set(hashes.values())) == 1
        self._keep(
            name,
            "end",
            f"  state hashes {'equal' if equal else 'DIFFER'} after frame {frame}, too",
            equal=equal,
            hash=sorted(set(hashes.values())),
        )

    def time(self, name: str, way: Way, timing: Timing, items: int, item: str, ours: bool) -> None:
        """Tell what a frame costs in one way."""
        seconds, each = timing.seconds, 1e9 * timing.seconds.median / items
        row = {"way": way.label, "threads": way.threads, "ours": ours, "seconds": seconds.median, "quartiles": seconds.quartiles}
        row |= {"spread": seconds.spread, "cores": timing.cores.median, "waited": timing.waited.median, "rounds": len(seconds.values)}
        text = f"  {way.label}: {number(1e3 * seconds.median)} ms, spread {seconds.spread:.0%}, {number(each)} ns a {item}"
        text += f", {timing.cores.median:.2f} cores, waited {timing.waited.median:.0%}"
        self._keep(name, "time", text, **row, items=items, item=item)

    def claim(self, name: str, label: str, sample: Sample, reach: float | None, disturbed: bool = False, most: bool = False) -> None:
        """Hold a measured number against what is to reach; `most`: it is to stay below. What scatters is not called a result."""
        value, (low, high) = sample.median, sample.quartiles
        if disturbed:
            verdict = f"{NO_RESULT}: other programs took the cores; run `--only {name}` when they rest"
        elif not sample.settled:
            verdict = f"{NO_RESULT}: spread {sample.spread:.0%} > {MOST_SPREAD:.0%}; run `--only {name}` when nothing else runs"
        elif reach is None:
            verdict = ""
        else:
            verdict = REACHED if (value <= reach if most else value >= reach) else MISSED
        text = f"  {label}: {number(value)} ({number(low)} to {number(high)})"
        text += "" if reach is None else f", to reach {'<' if most else '>='} {reach:g}"
        row = {"claim": label, "value": value, "quartiles": (low, high), "spread": sample.spread, "reach": reach, "most": most}
        self._keep(name, "claim", text + (f": {verdict}" if verdict else ""), **row, verdict=verdict)

    def unmeasured(self, name: str, label: str, reach: float | None, why: str) -> None:
        """Tell that a number is to reach, and why it was not measured."""
        self._keep(name, "claim", f"  {label}: not measured, {why}", claim=label, value=None, reach=reach, verdict=f"not measured: {why}")

    def phases(self, name: str, way: str, seconds: dict[str, float]) -> None:
        """Tell what the stages of a frame take."""
        total = sum(seconds.values())
        text = ", ".join(f"{stage} {number(1e3 * value)} ({value / total:.0%})" for stage, value in seconds.items())
        self._keep(name, "phases", f"  stages one by one, {way}, ms: {text}", way=way, phases=seconds)

    def table(self) -> None:
        """Print all claims."""
        table = Table(title="Figures and what is to reach", title_justify="left", header_style="bold")
        for column in ("", "", "measured", "quartiles", "to reach", ""):
            table.add_column(column, justify="right" if column in ("measured", "quartiles", "to reach") else "left")
        before = None
        for row in self.rows:
            if row.get("kind") != "claim":
                continue
            quartiles = " to ".join(map(number, row["quartiles"])) if "quartiles" in row else ""
            reach = "" if row["reach"] is None else f"{'<' if row.get('most') else '≥'} {row['reach']:g}"
            value = "" if row["value"] is None else number(row["value"])
            table.add_row(row["row"] if row["row"] != before else "", row["claim"], value, quartiles, reach, row["verdict"])
            before = row["row"]
        self.console.print(table)

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

    def _keep(self, name: str, kind: str, text: str, **row) -> None:
        self.rows.append({"row": name, "kind": kind, **row})
        self.console.print(text, soft_wrap=True, highlight=False)
