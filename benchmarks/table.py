"""One table of all that was measured: for a person at the end of a run, and for docs/performance.md, from the same JSON lines."""

from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from benchmarks.report import MISSED, NO_RESULT, NOT_MEASURED, REACHED, number

HEADER = ("", "warpsim, 1 core", "all cores", "beside", "takes", "ratio", "quartiles", "to reach", "")
HEADER_ALONE = ("", "", "measured", "quartiles", "to reach", "")
STYLES = {REACHED: "green", MISSED: "red", NO_RESULT: "yellow", NOT_MEASURED: "dim"}


@dataclass(frozen=True)
class Line:
    """One number of a row and what is to reach; the first of a row tells what was done, and how long we take."""

    work: str
    one: str
    all: str
    beside: str
    takes: str
    measured: str
    quartiles: str
    reach: str
    verdict: str
    why: str

    @property
    def cells(self) -> list[str]:
        """In the order of the header, without the verdict."""
        return [self.work, self.one, self.all, self.beside, self.takes, *self.alone[2:]]

    @property
    def alone(self) -> list[str]:
        """The same for what has no frames and no peers."""
        return [self.work, self.beside, self.measured, self.quartiles, self.reach]


def by_name(rows: list[dict]) -> dict[str, list[dict]]:
    """Return the rows of each measurement, in their order."""
    found: dict[str, list[dict]] = {}
    for row in rows:
        if row["row"]:
            found.setdefault(row["row"], []).append(row)
    return found


def milliseconds(seconds: float) -> str:
    """Return a time of a frame."""
    return f"{number(1e3 * seconds)} ms"


def lines_of(rows: list[dict]) -> list[Line]:
    """Return the lines of one measurement: what is to reach first, comparisons core for core are left to the JSON lines."""
    times = {row["way"]: row for row in rows if row["kind"] == "time"}
    roles = {row["role"]: row for row in times.values()}
    lines: list[Line] = []
    for row in rows:
        if row["kind"] != "claim" or ("fast" in row and row["reach"] is None and times[row["fast"]]["role"] == "one" and "all" in roles):
            continue
        slow = times.get(row.get("slow", ""))
        own = slow is not None and slow["role"] == "one"
        beside = "itself on 1 core" if own else slow["way"] if slow else row["claim"]
        value = "" if row["value"] is None else number(row["value"]) + ("×" if slow else "")
        first = not lines
        lines.append(
            Line(
                work=row["row"] if first else "",
                one=milliseconds(roles["one"]["seconds"]) if first and "one" in roles else "",
                all=milliseconds(roles["all"]["seconds"]) if first and "all" in roles else "",
                beside=beside,
                takes=milliseconds(slow["seconds"]) if slow and not own else "",
                measured=value,
                quartiles=" to ".join(map(number, row["quartiles"])) if row["value"] is not None else "",
                reach="" if row["reach"] is None else f"{'≤' if row['below'] else '≥'} {row['reach']:g}",
                verdict=row["verdict"],
                why=row["why"],
            )
        )
    return lines


def split(rows: list[dict]) -> tuple[list[list[dict]], list[list[dict]]]:
    """Return the measurements that have frames, and the others."""
    measurements = list(by_name(rows).values())
    framed = [any(row["kind"] == "time" for row in measurement) for measurement in measurements]
    return tuple([m for m, with_frames in zip(measurements, framed, strict=True) if with_frames == wanted] for wanted in (True, False))


def print_table(rows: list[dict], console: Console) -> None:
    """Print the tables at the end of a run, then what is no result and why."""
    reasons = []
    for title, header, measurements in zip(("Frames", "Other figures"), (HEADER, HEADER_ALONE), split(rows), strict=True):
        table = Table(title=f"\n{title}, and what is to reach", title_justify="left", header_style="bold", title_style="bold")
        for column in header:
            table.add_column(column, justify="left" if column in ("", "beside") else "right", overflow="fold")
        for measurement in measurements:
            for line in lines_of(measurement):
                style = STYLES.get(line.verdict, "none")
                table.add_row(*(line.cells if header is HEADER else line.alone), f"[{style}]{line.verdict}[/{style}]")
                reasons += [f"{measurement[0]['row']}, {line.beside}: {line.verdict}, {line.why}"] if line.why else []
            table.add_section()
        if table.row_count:
            console.print(table)
    for text in reasons:
        console.print(text, soft_wrap=True, highlight=False)
    verdicts = [row["verdict"] for row in rows if row["kind"] == "claim" and (row["reach"] is not None or row["verdict"])]
    counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in STYLES)
    console.print(f"{len(verdicts)} figures to judge: {counts}", highlight=False)


def markdown(rows: list[dict], picture: str | None = None) -> str:
    """Return the part of docs/performance.md that is measured; `picture`: where the picture of scaling lies, seen from the page."""
    framed, others = split(rows)
    parts = [head(rows), table_of(HEADER, framed), what_was_done(framed), table_of(HEADER_ALONE, others), what_was_done(others)]
    if picture and any(row["kind"] == "point" for row in rows):
        parts.append(f"![cost of one among a thousand and among ten million]({picture})")
    return "\n\n".join(part for part in parts if part)


def head(rows: list[dict]) -> str:
    """Return the sentence that tells where and when."""
    machines = [row for row in rows if row["kind"] == "machine"]
    works = [row for row in rows if row["kind"] == "work"]
    if not machines or not works:
        return ""
    machine, one = machines[-1], len({row["command"] for row in machines}) == 1
    how = f"`{machine['command']}`" if one else f"`python -m benchmarks --only …` in {len(machines)} runs"
    dates, loads = sorted(row["date"] for row in works), [row["load"] for row in works]
    when = dates[0] if dates[0] == dates[-1] else f"{dates[0]} to {dates[-1][11:] if dates[0][:10] == dates[-1][:10] else dates[-1]}"
    packages = ", ".join(f"{name} {machine[name]}" for name in ("warp-lang", "numpy", "numba", "taichi"))
    return (
        f"{how}, {when} UTC: {machine['cores']} cores of an {machine['processor']}, {machine['memory_gib']:g} GiB, "
        f"GPU: {machine['gpu']}; Python {machine['python']}, {packages}; load {min(loads):.1f} to {max(loads):.1f} before a row began."
    )


def table_of(header: tuple[str, ...], measurements: list[list[dict]]) -> str:
    """Return claims as a table in Markdown."""
    if not measurements:
        return ""
    found = [f"| {' | '.join(header)} |", f"|{'|'.join('---' if name in ('', 'beside') else '---:' for name in header)}|"]
    for measurement in measurements:
        for line in lines_of(measurement):
            verdict = f"**{line.verdict}**" if line.verdict == MISSED else line.verdict
            cells = line.cells if header is HEADER else line.alone
            found.append("| " + " | ".join([*cells, verdict + (f": {line.why.split(';')[0]}" if line.why else "")]) + " |")
    return "\n".join(found)


def what_was_done(measurements: list[list[dict]]) -> str:
    """Return what stands behind each name: the work, whose states are equal, how far away the peers are."""
    found = []
    for measurement in measurements:
        words = [row["work"] for row in measurement if row["kind"] == "work"]
        words += [states_of(row) for row in measurement if row["kind"] == "states"]
        words += [f"{row['peer']} not installed" for row in measurement if row["kind"] == "missing"]
        found.append(f"* `{measurement[0]['row']}`: {'. '.join(words)}.")
    return "\n".join(found)


def states_of(row: dict) -> str:
    """Return how far the states of all who took part agree."""
    words = f"State hashes of {', '.join(row['hashes'])} {'equal' if row['equal'] else '**differ**'}"
    if row["apart"]:
        far = ", ".join(f"{label} {distance:.1e} {row['unit']}" for label, distance in row["apart"].items())
        words += f"; away from ours: {far} (at most {row['most']:.1e}: {row['why']})"
    return words
