"""Every kernel compiles for data-center GPUs (A100: sm_80; H100, H200: sm_90), on a machine without one."""

import ast
import importlib
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "kernels"


def has_kernel(path: Path) -> bool:
    """False for files of formulas alone: those are compiled inside the kernels that call them."""
    decorators = [ast.unparse(d) for node in ast.walk(ast.parse(path.read_text())) for d in getattr(node, "decorator_list", [])]
    return any(text.startswith("wp.kernel") for text in decorators)


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("[!_]*.py") if has_kernel(path)))
def test_kernel_module_compiles_for_cuda(name, tmp_path):
    import warp as wp

    module = importlib.import_module(f"warpsim.kernels.{name}")
    built = wp.compile_aot_module(module, arch=[80, 90], module_dir=tmp_path, use_ptx=True)
    assert len(built) == 2 and all(path.stat().st_size for path in built), built
