"""validate: check scenes without running them, and without Warp."""

from typing import Annotated

import typer

JSON = Annotated[bool, typer.Option("--json", help="Print the result as JSON.")]


def validate(
    scenes: Annotated[list[str], typer.Argument(metavar="SCENE...", help="Scene files or names of shipped scenes.")],
    json: JSON = False,
) -> int:
    """Check scenes without running them: every mistake at once, with its line and column."""
    from warpsim.cli.outcome import Exit, print_json
    from warpsim.cli.scenes import found
    from warpsim.scene import SceneError, load_scene

    results, errors = [], []
    for text, path in [(text, found(text)) for text in scenes]:
        try:
            scene = load_scene(path)
            results.append({"scene": text, "ok": True, "name": scene.name, "systems": list(scene.systems), "problems": []})
        except SceneError as error:
            errors.append(str(error))
            results.append({"scene": text, "ok": False, "problems": [_plain(problem) for problem in error.problems]})
    if json:
        print_json(results)
    else:
        for result in results:
            print(f"{result['scene']}: " + ("ok" if result["ok"] else f"{len(result['problems'])} problem(s)"))
        for error in errors:
            typer.echo(f"\n{error}", err=True)
    return Exit.BAD_SCENE if errors else Exit.OK


def _plain(problem) -> dict[str, object]:
    names = ("file", "line", "column", "path", "message", "suggestion")
    return {name: value if isinstance(value := getattr(problem, name), int | None) else str(value) for name in names}
