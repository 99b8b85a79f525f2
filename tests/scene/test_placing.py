"""What shows only when a scene is built, because it is inside a file, is told where the scene names it."""

import pytest

from tests import surfaces
from warpsim import SceneError, Simulation, load_scene
from warpsim.scene.placing import placed_in

TEXT = """\
name: t
systems:
  p:
    type: particles
    emitters:
      - {rate: 1, shape: {type: mesh, file: open.obj, fill: volume}}
"""
WORDS = "systems.p.emitters.0.shape.fill: an open mesh encloses nothing"


@pytest.fixture
def path(tmp_path):
    """A scene that wants an open mesh filled."""
    surfaces.write_obj(tmp_path / "open.obj", surfaces.block([0, 0, 0], [1, 1, 1])[:-1])
    (tmp_path / "s.yaml").write_text(TEXT)
    return tmp_path / "s.yaml"


def told(path, overrides=()) -> str:
    with pytest.raises(SceneError) as caught, placed_in(path, overrides):
        Simulation(load_scene(path, overrides), device="cpu")
    return str(caught.value)


def test_it_has_line_and_column_and_the_line_itself(path):
    assert told(path).startswith(f"{path}:6:61: {WORDS}") and "^^^^^^" in told(path)
    assert told(path, ["systems.p.emitters.0.shape.fill=volume"]).startswith(f"--set 1:1:33: {WORDS}")


def test_where_the_text_is_silent_it_is_what_the_text_says_next_above(path):
    path.write_text(TEXT.replace(", fill: volume", ""))
    assert told(path).startswith(f"{path}:6:26: {WORDS}")


def test_where_the_file_is_gone_by_then_the_path_is_all(path):
    scene = load_scene(path)
    path.unlink()
    with pytest.raises(SceneError, match=f"^{WORDS}"), placed_in(path):
        Simulation(scene, device="cpu")
