"""What the measurements say: lines for people as they come in, and one JSON object for each."""

import json
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from rich.console import Console
from rich.markup import escape

from benchmarks.measure import MOST_SPREAD, Sample, Timing, Way, machine_load

REACHED, MISSED, NO_RESULT, NOT_MEASURED = "reached", "missed", "no result", "not measured"
OTHERS = "other programs took the cores"


def number(value: float) -> str:
    """Return three figures of a number, as people write it."""
    return f"{value:.3g}" if 1e-3 <= abs(value) < 1000 or value == 0 else f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.1e}"


def verdict_of(sample: Sample, reach: float | None, below: bool, disturbed: str, name: str) -> tuple[str, str]:
    """Return reached, missed, no result or nothing, and why or how to get one; `disturbed`: by what, if by anything."""
    if disturbed:
        return NO_RESULT, f"{disturbed}; --only {name} when nothing else runs"
    if not sample.settled:
        return NO_RESULT, f"spread {sample.spread:.1%} > {MOST_SPREAD:.0%}; --only {name} when nothing else runs"
    if reach is None:
        return "", ""
    return (REACHED if (sample.median <= reach if below else sample.median >= reach) else MISSED), ""


@dataclass
class Report:
    """Rows as they come in, each one JSON object. `path`: the file they are added to at once, so that a broken run leaves what it has."""

    console: Console
    path: Path | None = None
    rows: list[dict] = field(default_factory=list)

    def machine(self, facts: dict) -> None:
        """Head the run."""
        self._keep("", "machine", ", ".join(f"{key}: {value}" for key, value in facts.items()), **facts)

    def begin(self, name: str, work: str) -> None:
        """Head a row."""
        now = f"{datetime.now(UTC):%Y-%m-%d %H:%M}"
        self._keep(name, "work", f"\n[bold]{escape(name)}[/bold]: {escape(work)}", work=work, date=now, load=machine_load())

    def missing(self, name: str, peer: str, package: str) -> None:
        """Tell of a peer that is not there."""
        self._keep(name, "missing", f"  {peer}: not installed; pip install warpsim\\[bench] brings {package}", peer=peer, package=package)

    def states(self, name: str, frame: int, hashes: dict[str, str], apart: dict[str, float], most: float, unit: str, why: str) -> None:
        """Tell of the states in which the turns begin."""
        equal = len(set(hashes.values())) == 1
        text = f"  state hashes in frame {frame} {'equal' if equal else 'DIFFER'}: {', '.join(hashes)}"
        for label, distance in apart.items():
            text += f"\n  {label}: {distance:.1e} {unit} from ours, at most {most:.1e} ({why})"
            text += "" if distance <= most else "; STATES DIFFER, not timed"
        row = {"frame": frame, "equal": equal, "hashes": hashes, "apart": apart, "most": most, "unit": unit, "why": why}
        self._keep(name, "states", text, **row)

    def end_states(self, name: str, hashes: dict[str, str], frame: int) -> None:
        """Tell of the states in which the turns end."""
        equal = len(set(hashes.values())) == 1
        self._keep(name, "end", f"  … and in frame {frame} {'equal' if equal else 'DIFFERENT'}", frame=frame, equal=equal, hashes=hashes)

    def time(self, name: str, way: Way, timing: Timing, items: int, item: str, role: str) -> None:
        """Tell what a frame costs in one way. role: one (core), all (cores), plain, peer."""
        seconds, each = timing.seconds, 1e9 * timing.seconds.median / items
        row = {"way": way.label, "threads": way.threads, "role": role, "seconds": seconds.median, "quartiles": seconds.quartiles}
        row |= {"spread": seconds.spread, "cores": timing.cores.median, "waited": timing.waited.median, "rounds": len(seconds.values)}
        text = f"  {way.label}: {number(1e3 * seconds.median)} ms, spread {seconds.spread:.0%}, {number(each)} ns a {item}"
        text += f", {timing.cores.median:.2f} cores, waited {timing.waited.median:.0%}"
        self._keep(name, "time", text, **row, items=items, item=item)

    def times_as_long(self, name: str, slow: Way, fast: Way, sample: Sample, reach: float | None, disturbed: str = "") -> None:
        """Hold against what is to reach how many times as long one way takes as another."""
        self.claim(name, f"{slow.label} / {fast.label}", sample, reach, disturbed, slow=slow.label, fast=fast.label)

    def claim(self, name: str, label: str, sample: Sample, reach: float | None, disturbed: str = "", below: bool = False, **more) -> None:
        """Hold a measured number against what is to reach; `below`: it is to stay below. What scatters is not called a result."""
        verdict, why = verdict_of(sample, reach, below, disturbed, name)
        value, (low, high) = sample.median, sample.quartiles
        text = f"  {label}: {number(value)} ({number(low)} to {number(high)})"
        text += "" if reach is None else f", to reach {'<=' if below else '>='} {reach:g}"
        row = {"claim": label, "value": value, "quartiles": (low, high), "spread": sample.spread, "reach": reach, "below": below}
        row |= {"verdict": verdict, "why": why, **more}
        self._keep(name, "claim", text + (f": {verdict}" if verdict else "") + (f", {why}" if why else ""), **row)

    def unmeasured(self, name: str, label: str, reach: float | None, why: str, below: bool = False) -> None:
        """Tell that a number is to reach, and why it was not measured."""
        row = {"claim": label, "value": None, "reach": reach, "below": below, "verdict": NOT_MEASURED, "why": why}
        self._keep(name, "claim", f"  {label}: not measured, {why}", **row)

    def point(self, name: str, way: str, count: int, sample: Sample, settled: bool) -> None:
        """Keep a point of a curve: seconds per frame of so many."""
        low, high = (1e9 * value / count for value in sample.quartiles)
        each = 1e9 * sample.median / count
        text = f"  {count:>12,} {way}: {number(each)} ns each ({number(low)} to {number(high)})" + ("" if settled else ", no result")
        row = {"way": way, "count": count, "seconds": sample.median, "ns": each, "quartiles_ns": (low, high), "settled": settled}
        self._keep(name, "point", text, **row)

    def phases(self, name: str, way: str, seconds: dict[str, float]) -> None:
        """Tell what the stages of a frame take."""
        total = sum(seconds.values())
        text = ", ".join(f"{stage} {number(1e3 * value)} ({value / total:.0%})" for stage, value in seconds.items())
        self._keep(name, "phases", f"  stages one by one, {way}, ms: {text}", way=way, phases=seconds)

    def note(self, name: str, text: str, **row) -> None:
        """Tell something else, and keep its numbers."""
        self._keep(name, "note", f"  {text}", **row)

    def figures(self, case: str, what: str, header: list[str], lines: list[tuple[list[str], dict]]) -> None:
        """Tell the lines of a table of its own."""
        for cells, row in lines:
            named = [f"{head} {cell}".strip() for head, cell in zip(header, cells, strict=True) if cell]
            self._keep(case, "figures", f"  {', '.join(named)}", what=what, **row)

    def fact(self, case: str, label: str, text: str, **row) -> None:
        """As `note`, for modules that are not contests yet."""
        self._keep(case, "fact", f"  {label}: {text}", fact=label, **row)

    def _keep(self, name: str, kind: str, text: str, **row) -> None:
        self.rows.append({"row": name, "kind": kind, **row})
        if self.path:
            with self.path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(self.rows[-1]) + "\n")
        self.console.print(text, soft_wrap=True, highlight=False)


def read_rows(paths: list[Path]) -> list[dict]:
    """Return the rows of several runs as those of one: what a later file says of a row replaces what an earlier one says."""
    found: dict[str, list[dict]] = {"": []}
    for path in paths:
        rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
        for name in dict.fromkeys(row["row"] for row in rows):
            before = found[""] if name == "" else []  # every run has a machine
            found[name] = before + [row for row in rows if row["row"] == name]
    return [row for rows in found.values() for row in rows]


def write_rows(rows: list[dict], path: Path) -> None:
    """Write rows as JSON lines."""
    path.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
