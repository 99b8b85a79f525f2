"""verify: measure what scenes state about themselves."""

import math
import sys
from typing import Annotated

import typer

from warpsim.cli.run import DEVICE
from warpsim.cli.threads import Threads, thread_count
from warpsim.cli.validate import JSON


def verify(
    scenes: Annotated[list[str], typer.Argument(metavar="SCENE...", help="Scene files or names of shipped scenes.")],
    device: Annotated[str, typer.Option(metavar="auto|cpu|cuda:N", help="Where to compute.")] = "auto",
    seed: Annotated[int | None, typer.Option(metavar="N", help="Seed, instead of the scene's.")] = None,
    overrides: Annotated[list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Change a value. Repeatable.")] = None,
    threads: Threads = None,
    json: JSON = False,
) -> int:
    """Measure what scenes state about themselves (verify:), and say PASS or FAIL."""
    from warpsim.cli.outcome import Exit, Failure, interruption_told, print_json
    from warpsim.cli.scenes import found

    if not DEVICE.fullmatch(device):
        raise Failure(Exit.USAGE, f"--device {device}: say auto, cpu, cuda or cuda:N")
    paths = [found(text) for text in scenes]
    from warpsim.cli.progress import PlainLines
    from warpsim.interruption import Interruption

    results, cores = [], thread_count(threads, PlainLines(sys.stderr).note)
    with interruption_told(), Interruption():
        for text, path in zip(scenes, paths, strict=True):
            results.append(_examined(text, path, overrides or [], seed, device, cores, PlainLines(sys.stderr)))
            if not json:
                _show(results[-1])
    if json:
        print_json([_plain(result) for result in results])
    exits = {"bad scene": Exit.BAD_SCENE, "unstable": Exit.UNSTABLE, "failed": Exit.CHECK_FAILED, "empty": Exit.CHECK_FAILED}
    outcomes = {result["outcome"] for result in results}
    return next((code for outcome, code in exits.items() if outcome in outcomes), Exit.OK)


def _examined(text, path, overrides, seed, device, threads, audience) -> dict:
    """Return what there is to tell of one scene."""
    from warpsim.scene import SceneError, load_scene
    from warpsim.scene.placing import placed_in

    result = {"scene": text, "outcome": "bad scene", "findings": [], "error": None}
    try:
        scene = load_scene(path, overrides=overrides, seed=seed)
        if scene.verify:
            with placed_in(path, overrides):
                result["findings"] = _findings(scene, device, threads, audience)
        verdicts = {finding.verdict for finding in result["findings"]}
        worst = {"unmeasured": "unstable", "fail": "failed", "pass": "passed"}
        return result | {"outcome": next((word for verdict, word in worst.items() if verdict in verdicts), "empty")}
    except SceneError as error:
        return result | {"error": str(error)}


def _findings(scene, device, threads, audience):
    from warpsim.cli.outcome import Exit, Failure
    from warpsim.runner import NoSuchDevice, built, ready_device

    try:
        name = ready_device(device, audience)
    except NoSuchDevice as error:
        raise Failure(Exit.USAGE, str(error)) from None
    from warpsim.verify import verify_scene

    return verify_scene(scene, name, threads, lambda build: built(build, audience))


def _show(result: dict) -> None:
    """Print one scene's table, with colors on a terminal."""
    findings = result["findings"]
    counts = {verdict: sum(f.verdict == verdict for f in findings) for verdict in ("pass", "fail", "skipped", "unmeasured")}
    summary = ", ".join(f"{count} {verdict}" for verdict, count in counts.items() if count) or "no oracles: nothing is verified"
    if result["error"]:
        typer.echo(f"{result['scene']}: bad scene")
        typer.echo(f"\n{result['error']}", err=True)
        return
    typer.echo(f"{result['scene']}: {summary}")
    if findings:
        from warpsim.cli.tables import print_table

        print_table(("oracle", "kind", "measured", "expected", "error", "tolerance", "verdict"), [_row(f) for f in findings])
    for finding in findings:
        remarks = [text for text in (_detects(finding), finding.remark) if text]
        if remarks:
            typer.echo(f"  {finding.name}: {'; '.join(remarks)}")


def _detects(finding) -> str:
    """Say what change a statistical oracle would notice."""
    if finding.detects is None or not math.isfinite(finding.detects):
        return ""
    if finding.kind == "uniformity":
        return f"would notice a density that strays by {finding.detects:.2%} (root mean square) in 98 of 100 runs"
    share = f" ({abs(finding.detects / finding.expected):.2%})" if finding.expected else ""
    return f"would notice a change of {finding.detects:.3g}{share} in 98 of 100 runs"


def _row(finding) -> tuple[str, ...]:
    numbers = [_written(value) for value in (finding.measured, finding.expected, finding.error, finding.allowed)]
    return (finding.name, finding.kind, *numbers, "PASS" if finding.verdict == "pass" else finding.verdict.upper())


def _written(value, digits: int = 6) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return value
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    return "[" + ", ".join(_written(float(each), digits) for each in value) + "]"


def _plain(result: dict) -> dict:
    """Return a result for machines; what is not a finite number is null."""
    findings = [
        {
            "name": f.name,
            "kind": f.kind,
            "verdict": f.verdict,
            **{key: _number(getattr(f, key)) for key in ("measured", "expected", "error", "allowed", "detects")},
            "remark": f.remark,
            "reason": f.reason,
        }
        for f in result["findings"]
    ]
    return {"scene": result["scene"], "outcome": result["outcome"], "error": result["error"], "oracles": findings}


def _number(value):
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [_number(float(each)) for each in value]
