"""However warpsim gets onto a machine, the same code and scenes arrive, and nobody loses the name `kernels`."""

import os
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from pathlib import Path
from shutil import copytree, ignore_patterns

import pytest

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ["pyproject.toml", "README.md", "LICENSE", "kernels", "warpsim", "scenes"]
PROBE = """
import importlib, pkgutil, sys
import warpsim, warpsim.kernels
from warpsim.scene import shipped_scenes
for module in pkgutil.iter_modules(warpsim.kernels.__path__):
    importlib.import_module(f"warpsim.kernels.{module.name}")
try:
    import kernels
    sys.exit("the name `kernels` is taken")
except ImportError:
    pass
print(warpsim.__file__, warpsim.__version__, len(shipped_scenes()))
"""


def call(*command, cwd: Path) -> str:
    """Run a command, return what it printed; its errors are the failure's text."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run([str(part) for part in command], cwd=cwd, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def install(python: Path, *what) -> None:
    """Install with this environment's pip into another environment, offline."""
    pip = (sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", "--no-build-isolation")
    call(*pip, *what, cwd=python.parent)


@pytest.fixture(scope="module")
def new_environment(tmp_path_factory):
    """Make empty virtual environments that see this one's libraries (a plain path line runs no nested .pth file)."""

    def make(name: str) -> Path:
        folder = tmp_path_factory.mktemp(name)
        venv.create(folder)
        python = next(path for path in (folder / "bin" / "python", folder / "Scripts" / "python.exe") if path.exists())
        places = {sysconfig.get_path("purelib"), sysconfig.get_path("platlib")}
        site = call(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=folder).strip()
        Path(site, "libraries.pth").write_text("\n".join(places))
        return python

    return make


@pytest.fixture(scope="module")
def checkout(tmp_path_factory) -> Path:
    """A clean copy of the checkout."""
    copy = tmp_path_factory.mktemp("checkout")
    for name in SHIPPED:
        if (ROOT / name).is_dir():
            copytree(ROOT / name, copy / name, ignore=ignore_patterns("__pycache__"))
        else:
            (copy / name).write_bytes((ROOT / name).read_bytes())
    return copy


@pytest.fixture(scope="module")
def wheel(tmp_path_factory, checkout) -> Path:
    """Built from the source distribution, as an index would: that one must be complete too."""
    source = tmp_path_factory.mktemp("source")
    copytree(checkout, source / "tree")
    call(sys.executable, "-m", "build", "--no-isolation", "--outdir", source / "dist", source / "tree", cwd=source)
    return next((source / "dist").glob("*.whl"))


def test_pyproject_lists_every_package():
    listed = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]["packages"]
    found = {".".join(path.parent.relative_to(ROOT).parts) for path in (ROOT / "warpsim").rglob("__init__.py")}
    assert set(listed) == found | {"warpsim.kernels", "warpsim.scenes"}


def test_wheel_carries_kernels_and_scenes_and_nothing_else(wheel):
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    kept = {"kernels": ("py",), "scenes": ("yaml", "obj", "ply", "npz"), "warpsim": ("py", "html", "js")}
    files = [path for room, kinds in kept.items() for kind in kinds for path in (ROOT / room).rglob(f"*.{kind}")]
    paths = {str(path.relative_to(ROOT)) for path in files}
    assert names == {path if path.startswith("warpsim/") else f"warpsim/{path}" for path in paths}


@pytest.mark.parametrize("way", ["bare", "editable", "wheel", "wheel in the checkout"])
def test_warpsim_runs(way, checkout, new_environment, tmp_path, request):
    python = new_environment(way.replace(" ", "_"))
    if way == "editable":
        install(python, "--editable", checkout)
    elif way.startswith("wheel"):
        install(python, request.getfixturevalue("wheel"))
    cwd = checkout if way in ("bare", "wheel in the checkout") else tmp_path
    home, _, scene_count = call(python, "-c", PROBE, cwd=cwd).split()
    assert Path(home).is_relative_to(python.parents[1] if way == "wheel" else checkout)
    assert int(scene_count) == len([*(ROOT / "scenes").rglob("*.yaml")])
    call(python, "-m", "warpsim", "run", "campfire", "--viewer", "none", "--device", "cpu", "--frames", "2", cwd=cwd)
