"""Imports run one way: kernels <- systems, environment <- simulation <- runner <- cli; observers see frames only."""

import ast
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PLAYING = "playback reporting filming streamlines"  # what a run and a recorded run are shown with
SEES = {  # room -> the rooms it may import besides its own; `warpsim` alone (the version) is open to all
    "kernels": "",
    "scene": "",
    "files": "",
    "kernel_cache": "",
    "compiling": "kernel_cache",
    "interruption": "",
    "meshes": "scene",
    "networks": "scene meshes",
    "weaves": "networks",
    "amplification": "",
    "muscles": "scene networks",
    "flocks": "scene",
    "stability": "scene networks amplification muscles",
    "coloring": "kernels",
    "crossings": "",
    "budget": "scene networks stability",
    "cores": "",
    "crew": "kernels",
    "sharing": "",
    "launch": "kernels crew cores sharing compiling",
    "footprint": "scene grids",
    "keeping": "footprint",
    "population": "kernels keeping",
    "images": "kernels",
    "grids": "kernels scene",
    "colliders": "kernels scene meshes signals",
    "poses": "kernels scene colliders signals",
    "directions": "",
    "signals": "kernels scene",
    "environment": "kernels scene grids images launch colliders directions signals",
    "integrators": "kernels",
    "systems": "kernels scene launch population environment integrators signals directions frame footprint meshes networks muscles "
    "stability weaves coloring flocks budget compiling keeping",
    "frame": "",
    "memory": "stability scene footprint",
    "changes": "scene",
    "convergence": "kernels scene environment signals integrators flow_formulas",
    "flow_formulas": "",
    "plotting": "files",
    "replay": "kernels scene frame systems networks poses",
    "probes": "kernels environment directions",
    "simulation": "kernels scene launch environment systems frame memory probes poses changes stability keeping",
    "observers": "files meshes",
    "reporting": "",
    "filming": "observers",
    "streamlines": "files",
    "announcing": "observers reporting",
    "playback": "scene changes interruption reporting announcing",
    "runner": f"scene simulation changes observers kernel_cache compiling interruption {PLAYING}",
    "screening": f"environment probes replay runner interruption {PLAYING}",
    "verify": "scene simulation environment directions probes convergence meshes crossings",
    "cli": "scene cores simulation observers files kernel_cache interruption runner screening replay reporting memory footprint verify "
    "convergence plotting streamlines",
    "__main__": "cli",
    "__init__": "scene simulation frame",
}
OUTSIDE = {"kernels": {"warp"}, "scene": {"annotated_types", "pydantic", "pydantic_core", "yaml"}}  # rooms that choose their company
FILES = [*ROOT.glob("kernels/*.py"), *ROOT.glob("warpsim/**/*.py")]


def room(path: Path) -> str:
    """Name of the room a file stands in."""
    return "kernels" if path.is_relative_to(ROOT / "kernels") else path.relative_to(ROOT / "warpsim").parts[0].removesuffix(".py")


@cache
def imported(path: Path) -> frozenset[str]:
    """Dotted names of everything the file imports, wherever in it the import stands."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{path}:{node.lineno}: write the import with its full name"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return frozenset(names)


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_run_one_way(path):
    rooms = {name.split(".")[1] for name in imported(path) if name.startswith("warpsim.")} - {"__version__"}
    backwards = rooms - {room(path), *SEES[room(path)].split()}
    assert not backwards, f"{room(path)} must not import {sorted(backwards)}"


@pytest.mark.parametrize("path", [p for p in FILES if room(p) in OUTSIDE], ids=lambda path: str(path.relative_to(ROOT)))
def test_rooms_that_choose_their_company(path):
    packages = {name.split(".")[0] for name in imported(path)} - {"warpsim", "__future__"}
    strangers = packages - OUTSIDE[room(path)] - (sys.stdlib_module_names if room(path) != "kernels" else set())
    assert not strangers, f"{room(path)} must not import {sorted(strangers)}"


def test_every_room_sees_only_what_it_uses():
    used = {name: set() for name in SEES}
    for path in FILES:
        used[room(path)] |= {name.split(".")[1] for name in imported(path) if name.startswith("warpsim.")}
    idle = {name: sorted(set(seen.split()) - used[name]) for name, seen in SEES.items()}
    assert not {name: seen for name, seen in idle.items() if seen}
