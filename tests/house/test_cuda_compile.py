"""Every kernel compiles for data-center GPUs (A100: sm_80; H100, H200: sm_90; B200: sm_100), on a machine without one.

Each for one of them, in turns; all by `WARPSIM_ARCHITECTURES=all python -m pytest tests/house/test_cuda_compile.py`, some minutes.
"""

import ast
import ctypes
import importlib
import os
import re
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


ARCHITECTURES = (80, 90, 100)
ALL = os.environ.get("WARPSIM_ARCHITECTURES") == "all"


def architectures(place: int) -> list[int]:
    """Return what a module is compiled for: one after the other in turns, or all."""
    return list(ARCHITECTURES) if ALL else [ARCHITECTURES[place % 3]]


def compiled(kernels, folder, place: int) -> list[str]:
    """Return the PTX of the modules of kernels, as frames use them."""
    import warp as wp

    from warpsim.compiling import suit_gpu

    suit_gpu(kernels)
    built = []
    for module in {kernel.module.name: kernel.module for kernel in kernels}.values():  # some have modules of their own
        built += wp.compile_aot_module(module, arch=architectures(place), module_dir=folder, use_ptx=True)
    return [path.read_text() for path in built]


CALLED = ("clearance", "points", "render", "among_colliders")  # Warp's rays through meshes and the arc tangent of looks say so themselves


def is_sound(text: str, name: str) -> bool:
    """Return whether there is a kernel, and no product and sum of 32 bits that are rounded in one, where CPUs round each."""
    return ".entry" in text and (name.endswith(CALLED) or not re.search(r"fma\.rn(\.ftz)?\.f32", text))


@pytest.mark.parametrize("name", OWN)
def test_kernel_module_compiles_for_cuda(name, tmp_path):
    import warp as wp

    kernels = [value for value in vars(importlib.import_module(f"warpsim.kernels.{name}")).values() if isinstance(value, wp.Kernel)]
    for text in compiled(kernels, tmp_path, OWN.index(name)):
        assert is_sound(text, name)


STAGED = ("stage_3", "start_4", "predict_4", "foresee_2", "correct_4")


@pytest.mark.parametrize("stage", STAGED)
def test_stages_of_networks_compile_for_cuda(stage, tmp_path):
    from warpsim.kernels.staged import STAGES

    for text in compiled([STAGES[stage]], tmp_path, STAGED.index(stage)):
        assert is_sound(text, stage)


@pytest.mark.parametrize(("family", "method"), [(family, method) for family, methods in FAMILIES.items() for method in methods])
def test_methods_compile_for_cuda(family, method, tmp_path):
    made = importlib.import_module(f"warpsim.kernels.{family}").ADVANCE[method]
    for text in compiled([made[0] if isinstance(made, tuple) else made], tmp_path, FAMILIES[family].index(method)):
        assert is_sound(text, method)


def test_arguments_fit_into_what_a_launch_carries():
    """4 KiB: more needs a driver of CUDA 12.1. An array is 56 bytes, a struct what its fields are."""
    import warp as wp
    from warp._src.codegen import Struct
    from warp._src.types import array_t, is_array, type_size_in_bytes

    def size(kind) -> int:
        if is_array(kind):
            return ctypes.sizeof(array_t)
        return ctypes.sizeof(kind.ctype) if isinstance(kind, Struct) else type_size_in_bytes(kind)

    rooms = [importlib.import_module(f"warpsim.kernels.{path.stem}") for path in FOLDER.glob("[!_]*.py")]
    families = [value.values() if isinstance(value, dict) else [value] for room in rooms for value in vars(room).values()]
    members = [one for family in families for member in family for one in (member if isinstance(member, tuple) else (member,))]
    sizes = {kernel.key: sum(size(argument.type) for argument in kernel.adj.args) for kernel in members if isinstance(kernel, wp.Kernel)}
    assert len(sizes) > 150 and max(sizes.values()) <= 4096, max(sizes, key=sizes.get)
