"""python -m benchmarks: medians, spreads and ratios of the cases, each way of running in turn."""

import argparse
import platform
import sys
from importlib import import_module
from pathlib import Path

import warp as wp
from rich.console import Console

import warpsim
from benchmarks.cases import Case, million
from benchmarks.cloth import measure_cloth
from benchmarks.contest import Contest, Effort
from benchmarks.flocks import measure_flocks
from benchmarks.measure import Timing, Way, moves_per_frame, stage_shares, take_turns
from benchmarks.neighbors import measure_neighbors
from benchmarks.report import Report
from benchmarks.startup import measure_startup
from warpsim import SceneError, load_scene
from warpsim.kernel_cache import prepare_kernel_cache
from warpsim.launch import available_cores

MODULES = ("benchmarks.cases",)  # whose `rows(quick)` are the table
CASES = ("startup", "million", "neighbors", "flocks", "cloth")


def all_rows(quick: bool) -> dict[str, Contest]:
    """Return the rows of the table by name."""
    return {row.name: row for module in MODULES for row in import_module(module).rows(quick)}


def processor() -> str:
    """Name of this machine's processor, as well as the system tells it."""
    names = Path("/proc/cpuinfo")
    lines = names.read_text().splitlines() if names.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.processor() or platform.machine())


def ways(device: str) -> list[Way]:
    """One core, all cores, and the plain kernels on both; a GPU has one way."""
    if device != "cpu":
        return [Way("gpu", 1)]
    cores = available_cores()
    found = [Way("native, 1 thread", 1), Way("plain, 1 thread", 1, native=False)]
    if cores > 1:
        found[1:1] = [Way(f"native, {cores} threads", cores)]
        found += [Way(f"plain, {cores} threads", cores, native=False)]
    return found


def measure_ways(case: Case, report: Report, device: str, rounds: int) -> None:
    """Every way in turn: ns per particle and substep, equal hashes, ratios, stages."""
    runs = {way: way.build(case.scene, device) for way in ways(device)}
    for run in runs.values():
        run.run(seconds=case.warmup_frames / case.scene.time.fps)
    times = take_turns(runs, rounds, lambda: wp.synchronize_device(device))
    farthest = max(run.index for run in runs.values())
    for run in runs.values():
        run.seek(farthest)  # some have taken turns again
    hashes = {way: run.state_hash() for way, run in runs.items()}
    lines = []
    for way, timing in times.items():
        live = sum(system["live"] for system in runs[way].statistics().values())
        seconds, cores = timing.seconds, timing.cores.median
        nanoseconds = 1e9 * seconds.median / moves_per_frame(runs[way])
        cells = [
            way.label,
            f"{1e3 * seconds.median:.2f}",
            f"{seconds.spread:.0%}",
            f"{nanoseconds:.2f}",
            f"{cores:.2f}",
            f"{live:,}",
            hashes[way],
        ]
        row = {"way": way.label, "seconds": seconds.median, "spread": seconds.spread, "ns": nanoseconds, "cores": cores, "live": live}
        lines.append((cells, {**row, "hash": hashes[way]}))
    header = ["", "ms/frame", "spread", "ns/particle/substep", "cores got", "live", "state hash"]
    report.figures(case.name, case.what, header, lines)
    if len(set(hashes.values())) > 1:
        sys.exit("the ways do not agree: their state hashes differ")
    tell_ratios(case.name, report, times)
    for way, run in runs.items():
        shares = stage_shares(run, max(5, rounds // 3))
        text = ", ".join(f"{stage} {share:.1%}" for stage, share in shares.items())
        report.fact(case.name, f"stages, {way.label}", text, shares=shares)
    report.console.print()


def tell_ratios(name: str, report: Report, times: dict[Way, Timing]) -> None:
    """Plain over native for each number of threads, and one thread over all of them."""
    starved = any(timing.starved(way.threads) for way, timing in times.items() if way.native)
    natives = [way for way in times if way.native]
    for way in natives:
        for plain in times:
            if not plain.native and plain.threads == way.threads:
                ratio = times[plain].seconds.over(times[way].seconds)
                report.ratio(name, f"{plain.label} / {way.label}", ratio, bar=10.0, starved=starved and way.threads > 1)
    if len(natives) > 1:
        ratio = times[natives[0]].seconds.over(times[natives[1]].seconds)
        report.ratio(name, f"{natives[0].label} / {natives[1].label}", ratio, bar=1.5, starved=starved)


def measure_own(name: str, report: Report, device: str, rounds: int) -> None:
    """A scene by name or file, after its first second. Stops with the words for a scene that has mistakes."""
    try:
        scene = load_scene(name)
    except SceneError as error:
        sys.exit(str(error))
    measure_ways(Case(scene.name, scene.description or scene.name, scene, round(scene.time.fps)), report, device, rounds)


def measure_cases(wanted: set[str], options: argparse.Namespace, report: Report) -> None:
    """Run the cases that were asked for."""
    count, rounds = (20_000, 5) if options.quick else (options.count, options.rounds)
    on_cpu = options.device == "cpu"  # where the peers are
    for name, row in all_rows(options.quick).items():
        if name in wanted:
            report.begin(name, row.work)
            row.measure(report, Effort(1.0, 5, 3, quick=True) if options.quick else Effort(most_rounds=options.rounds))
    if "startup" in wanted:
        measure_startup(report, max(2, rounds // 3))
    if "million" in wanted:
        measure_ways(million(count), report, options.device, rounds)
    if "neighbors" in wanted and on_cpu:
        for size in (5_000,) if options.quick else (20_000, 100_000, count):
            measure_neighbors(size, report, max(5, rounds // 3))  # the peers take seconds
    if "flocks" in wanted and on_cpu:
        measure_flocks((2_000,) if options.quick else (10_000, 100_000, count), report, max(5, rounds // 3))
    if "cloth" in wanted and on_cpu:
        for size in (16,) if options.quick else (32, 64, 128, 256):
            measure_cloth(size, report, rounds)


def main() -> None:
    """Run the cases that were asked for, or a scene."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small counts and few rounds: shows that it works, not how fast")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write every figure as a JSON line")
    parser.add_argument("--only", choices=(*CASES, *all_rows(True)), help="one case alone")
    parser.add_argument("--scene", help="a scene alone, by name or file: all ways of running it")
    parser.add_argument("--count", type=int, default=1_000_000, help="particles of the main case")
    parser.add_argument("--rounds", type=int, default=30, help="turns of each way")
    parser.add_argument("--device", default="cpu", help="cpu or cuda:N")
    options = parser.parse_args()
    prepare_kernel_cache(print)
    report = Report(Console(width=None if sys.stdout.isatty() else 140))
    machine = {"processor": processor(), "cores": available_cores(), "device": options.device}
    machine |= {"python": platform.python_version(), "warp": wp.config.version, "warpsim": warpsim.__version__}
    report.fact("machine", "machine", ", ".join(f"{key}: {value}" for key, value in machine.items()), **machine)
    report.console.print()
    if options.scene:
        measure_own(options.scene, report, options.device, 5 if options.quick else options.rounds)
    else:
        measure_cases({options.only} if options.only else {*CASES, *all_rows(True)}, options, report)
    report.table()
    if options.json:
        report.write(options.json)


if __name__ == "__main__":
    main()
