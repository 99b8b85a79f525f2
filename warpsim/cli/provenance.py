"""What made a run: versions, device, threads, processor. It stands as comments above the resolved scene, so that the file still loads."""

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from warpsim import __version__

VECTOR_FEATURES = "sse2 ssse3 sse4_1 sse4_2 avx avx2 fma f16c avx512f avx512dq avx512bw avx512vl asimd sve".split()


def scene_text(scene, device: str, threads: int | None) -> str:
    """Return the text of a run folder's scene.yaml: provenance as comments, then the resolved scene."""
    from warpsim.scene import resolved_yaml

    facts = {
        "warpsim": __version__,
        "python": platform.python_version(),
        "warp-lang": _version("warp-lang"),
        "numpy": _version("numpy"),
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor_field("model name") or platform.processor() or "unknown",
        "processor features": " ".join(processor_features()) or "unknown",
        "device": device,
        "threads": threads or "all",
        "seed": scene.seed,
    }
    return "".join(f"# {name}: {value}\n" for name, value in facts.items()) + resolved_yaml(scene, recorded=True)


def processor_features() -> list[str]:
    """Return the vector extensions that this processor says it has; empty where the system does not tell."""
    flags = set((_processor_field("flags") or _processor_field("Features")).split())
    return [name for name in VECTOR_FEATURES if name in flags]


def _processor_field(name: str) -> str:
    try:
        with open(Path("/proc/cpuinfo"), encoding="utf-8") as file:
            return next((line.partition(":")[2].strip() for line in file if line.partition(":")[0].strip() == name), "")
    except OSError:
        return ""


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "unknown"
