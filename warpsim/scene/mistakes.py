"""Validation of a tree of nodes: pydantic's errors become Problems."""

from pydantic import ValidationError

from warpsim.scene.nodes import Mapping
from warpsim.scene.problems import Problem, SceneError
from warpsim.scene.scene import Scene


def validate(root: Mapping, problems: list[Problem]) -> Scene:
    try:
        scene = Scene.model_validate(root.data())
    except ValidationError as error:
        problems = problems + [root.problem(x["msg"], path=".".join(map(str, x["loc"]))) for x in error.errors()]
        raise SceneError(problems) from None
    if problems:
        raise SceneError(problems)
    return scene
