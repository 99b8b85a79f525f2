"""python -m benchmarks: what warpsim costs beside its peers, in turns, held against what is to reach; docs/performance.md is made of it."""

import argparse
import importlib.util
import re
import sys
import time
from importlib import import_module
from pathlib import Path

from rich.console import Console

from benchmarks.contest import Contest, Effort, Row
from benchmarks.machine import machine_facts
from benchmarks.picture import draw_scaling
from benchmarks.report import Report, read_rows, write_rows
from benchmarks.table import markdown, print_table
from warpsim import SceneError, load_scene
from warpsim.kernel_cache import prepare_kernel_cache

# Whose `rows(quick)` are the table, in its order.
MODULES = ("particles", "flocks", "neighbors", "cloth", "cases", "bandwidth", "scaling", "gpu", "startup")
BEGIN, END = "<!-- measured: begin, made by python -m benchmarks --page -->", "<!-- measured: end -->"
QUICK = Effort(seconds=0.2, most_rounds=3, least_rounds=3, quick=True)


def all_rows(quick: bool) -> dict[str, Row]:
    """Return the rows of the table by name."""
    modules = [import_module(f"benchmarks.{module}") for module in MODULES]
    return {row.name: row for module in modules for row in module.rows(quick)}


def own_scene(name: str) -> Contest:
    """Return a contest of a scene by name or file. Stops with the words for one that has mistakes."""
    try:
        scene = load_scene(name)
    except SceneError as error:
        sys.exit(str(error))
    return Contest(scene.name, scene.description or scene.name, scene, warmup=round(scene.time.fps), plain=0.0)


def parsed() -> argparse.Namespace:
    """Return what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small counts and few rounds: shows that every row runs, not how fast")
    parser.add_argument("--only", action="append", metavar="ROW", help="this row alone, or those whose names begin so; again for more")
    parser.add_argument("--list", action="store_true", help="name the rows")
    parser.add_argument("--scene", help="a scene alone, by name or file: one core, all, and the plain kernels")
    parser.add_argument("--json", type=Path, metavar="FILE", help="keep every figure as a JSON line")
    parser.add_argument("--rounds", type=int, default=30, help="turns of each way at most (default: 30)")
    parser.add_argument("--seconds", type=float, default=15.0, help="for the turns of a row (default: 15)")
    parser.add_argument(
        "--page", type=Path, nargs="+", metavar="FILE", help="measure nothing: make the tables of docs/performance.md from such files"
    )
    parser.add_argument(
        "--into",
        type=Path,
        metavar="PAGE",
        help="with --page: put them between the page's markers, and the figures beside it; default: print them",
    )
    return parser.parse_args()


def wanted(options: argparse.Namespace) -> list[Row]:
    """Return the rows that were asked for, in the table's order. Stops with words where there is none of a name."""
    if options.scene:
        return [own_scene(options.scene)]
    known = all_rows(options.quick)
    for name in options.only or ():
        if not any(known_name.startswith(name) for known_name in known):
            sys.exit(f"there is no row {name}; there are {', '.join(known)}")
    return [row for name, row in known.items() if not options.only or any(name.startswith(start) for start in options.only)]


def measure(options: argparse.Namespace, console: Console) -> list[dict]:
    """Run the rows that were asked for; return what they say."""
    prepare_kernel_cache(print)
    if options.json:
        options.json.unlink(missing_ok=True)
    report = Report(console, options.json)
    report.machine(machine_facts(" ".join(["python -m benchmarks", *(Path(word).name for word in sys.argv[1:])])))
    effort = QUICK if options.quick else Effort(options.seconds, options.rounds)
    for row in wanted(options):
        began = time.perf_counter()
        report.begin(row.name, row.work)
        row.measure(report, effort)
        report.note(row.name, f"this row took {time.perf_counter() - began:.0f} s", took=time.perf_counter() - began)
    return report.rows


def put_between(page: Path, text: str) -> None:
    """Put text between the markers of a page. Stops with words where it has none."""
    old = page.read_text(encoding="utf-8")
    new, count = re.subn(
        f"({re.escape(BEGIN)}).*?({re.escape(END)})", lambda found: f"{found[1]}\n\n{text}\n{found[2]}", old, flags=re.DOTALL
    )
    if count != 1:
        sys.exit(f"{page} has no place for the tables: it needs the lines {BEGIN} and {END}")
    page.write_text(new, encoding="utf-8")


def make_page(files: list[Path], page: Path | None) -> None:
    """Print the tables, or put them and the picture into a page, and the figures beside it."""
    rows = read_rows(files)
    if page is None:
        print(markdown(rows))
        return
    write_rows(rows, page.with_suffix(".jsonl"))
    picture = page.parent / "images" / "scaling.png"
    picture.parent.mkdir(exist_ok=True)
    draw_scaling(rows, picture)
    put_between(page, markdown(rows, "images/scaling.png"))


def main() -> None:
    """Measure, or make a page of what was measured."""
    options, console = parsed(), Console(width=None if sys.stdout.isatty() else 180)
    if options.page:
        make_page(options.page, options.into)
    elif options.list:
        for name, row in all_rows(options.quick).items():
            print(f"{name:20} {row.work}")
    else:
        rows = measure(options, console)
        print_table(rows, console)
        if options.json and importlib.util.find_spec("matplotlib") and draw_scaling(rows, options.json.with_suffix(".png")):
            console.print(f"how the cost grows: {options.json.with_suffix('.png')}")


if __name__ == "__main__":
    main()
