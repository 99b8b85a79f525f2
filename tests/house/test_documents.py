"""What the documents show works: scenes, Python, links, and the command that CI takes from the README."""

import re
from pathlib import Path

import pytest

from warpsim import SceneError, Simulation
from warpsim.scene import load_text

ROOT = Path(__file__).resolve().parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]


def blocks(language: str) -> list:
    """Code blocks of a language, with the page and their number."""
    found = [(page, text) for page in PAGES for text in re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.S | re.M)]
    return [pytest.param(text, id=f"{page.stem}-{number}") for number, (page, text) in enumerate(found)]


@pytest.mark.parametrize("text", [case for case in blocks("yaml") if "systems:" in case.values[0]])
def test_scene_in_a_page_runs(text):
    frame = list(Simulation(load_text(text, "page.yaml"), device="cpu", threads=1).frames(5))[-1]
    assert all(frame[name].count for name in frame.names)


@pytest.mark.parametrize("text", blocks("python"))
def test_python_in_a_page_runs(text):
    exec(compile(text, "page.py", "exec"), {})  # our own pages; a scene is never executed


def test_readme_shows_the_error_that_users_see():
    readme = (ROOT / "README.md").read_text()
    scene, shown = (re.search(rf"^```{language}\n(.*?)^```", readme, re.S | re.M).group(1) for language in ("yaml", "text"))
    with pytest.raises(SceneError) as refused:
        load_text(scene.replace("circulation:", "circulaton:"), "whirlwind.yaml")
    assert shown.strip() in str(refused.value)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    links = re.findall(r"\]\(([^)#:]+)\)", page.read_text())
    assert not [link for link in links if not (page.parent / link).exists()]


def test_readme_has_the_two_commands():
    lines = (ROOT / "README.md").read_text().splitlines()
    assert sum(line.endswith("-m warpsim run campfire") for line in lines) == 1
    assert sum(" -m pytest " in line for line in lines) == 1  # .ci/run takes this line


def test_every_scene_stands_in_the_list_with_its_picture():
    text = (ROOT / "docs" / "scenes.md").read_text()
    for path in (ROOT / "scenes").rglob("*.yaml"):
        assert f"images/scenes/{path.stem}.jpg" in text and f"`{path.stem}`" in text, path.stem
