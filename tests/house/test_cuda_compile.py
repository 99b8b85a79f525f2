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


ON_CPU = {"convergence"}  # one particle at a time, in float64
# Each method has a Warp module of its own: of these families, the members that between them call every formula.
FAMILIES = {
    "advance": (
        "rk4",
        "tracer_rk4",
        "rk4_among_colliders",
        "tracer_rk4_among_colliders",
        "abm_pece_4",
        "tracer_abm_pece_4",
        "adams_bashforth_3",
    ),
    "adaptive": ("abm_pece_4", "tracer_abm_pece_2"),
}
OWN = sorted(path.stem for path in FOLDER.glob("[!_]*.py") if has_kernel(path) and path.stem not in ON_CPU | {"adaptive"})


@pytest.mark.parametrize("name", OWN)
def test_kernel_module_compiles_for_cuda(name, tmp_path):
    import warp as wp

    kernels = [value for value in vars(importlib.import_module(f"warpsim.kernels.{name}")).values() if isinstance(value, wp.Kernel)]
    for module in {kernel.module.name: kernel.module for kernel in kernels}.values():  # some have modules of their own
        built = wp.compile_aot_module(module, arch=[80, 90], module_dir=tmp_path, use_ptx=True)
        assert len(built) == 2 and all(path.stat().st_size for path in built), built


@pytest.mark.parametrize("stage", ["stage_3", "start_4", "predict_4", "foresee_2", "correct_4"])
def test_stages_of_networks_compile_for_cuda(stage, tmp_path):
    import warp as wp

    from warpsim.kernels.staged import STAGES

    (built,) = wp.compile_aot_module(STAGES[stage].module, arch=[90], module_dir=tmp_path, use_ptx=True)
    assert built.stat().st_size


@pytest.mark.parametrize(("family", "method"), [(family, method) for family, methods in FAMILIES.items() for method in methods])
def test_methods_compile_for_cuda(family, method, tmp_path):
    import warp as wp

    made = importlib.import_module(f"warpsim.kernels.{family}").ADVANCE[method]
    plain = made[0] if isinstance(made, tuple) else made
    (built,) = wp.compile_aot_module(plain.module, arch=[90], module_dir=tmp_path, use_ptx=True)
    assert built.stat().st_size
