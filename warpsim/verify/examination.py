"""One examination of a scene: its oracles are sorted by the story they need, each story is played once, and all are judged."""

from collections.abc import Callable
from typing import Any

import numpy as np

from warpsim.environment import Environment
from warpsim.probes import FlowProbe
from warpsim.simulation import Simulation, UnstableError
from warpsim.verify.findings import Finding, judged
from warpsim.verify.measurers import FlowMeasurer, StoryMeasurer
from warpsim.verify.motion import ParticleMeasurer
from warpsim.verify.registry import measurer_of
from warpsim.verify.stories import play, with_test_particles


def verify_scene(scene, device: str, threads: int | None = None, built: Callable[[Callable[[], Any]], Any] = lambda build: build()):
    """Return what the oracles of a scene find, in their order, on a device by Warp's name.

    `built` calls what builds simulations, so that a caller can say that kernels compile. Raises what building raises: SceneError for
    memory or files that do not serve, ValueError for too few threads.
    """
    findings: dict[int, Finding] = {}
    measurers = {}
    for k, oracle in enumerate(scene.verify):
        if unmeasurable := oracle.lawless(scene):
            findings[k] = Finding(name_of(k, oracle), oracle.type, "fail", remark=unmeasurable, reason=oracle.reason)
        elif getattr(oracle, "device", None) not in (None, kind_of(device)):
            remark = f"stated for {oracle.device}; this is {kind_of(device)}"
            findings[k] = Finding(name_of(k, oracle), oracle.type, "skipped", expected=oracle.expect, remark=remark, reason=oracle.reason)
        else:
            measurers[k] = measurer_of(oracle, scene)
    probe([measurer for measurer in measurers.values() if isinstance(measurer, FlowMeasurer)], scene, device, built)
    blown_up: dict[StoryMeasurer, UnstableError] = {}
    for story in stories(measurers.values()):
        try:
            play(built(lambda story=story: Simulation(staged(scene, story), device, threads)), story)
        except UnstableError as error:  # who has seen all frames before it has an answer
            blown_up |= {measurer: error for measurer in story if measurer.frames.last >= error.index and not measurer.satisfied}
    for k, measurer in measurers.items():
        name, oracle = name_of(k, measurer.oracle), measurer.oracle
        if measurer in blown_up:
            remark = f"unstable: {blown_up[measurer]}"
            findings[k] = Finding(name, oracle.type, "unmeasured", remark=remark, reason=oracle.reason)
        else:
            with np.errstate(all="ignore"):  # what is not a number fails, without a word from NumPy
                findings[k] = judged(name, oracle, measurer.reading())
    return [findings[k] for k in sorted(findings)]


def probe(measurers: list[FlowMeasurer], scene, device: str, built: Callable[[Callable[[], Any]], Any]) -> None:
    """Let all that measure the flow alone do so; it needs no simulation."""
    if measurers:
        flow = built(lambda: FlowProbe(Environment(scene, device), lambda: 0.0))
        for measurer in measurers:
            with np.errstate(all="ignore"):
                measurer.probe(flow)


def name_of(number: int, oracle) -> str:
    """Return what an oracle is called in results: its name, else its number, as in `--set verify.2.tolerance`."""
    return oracle.name or str(number)


def kind_of(device: str) -> str:
    """Return cpu or cuda."""
    return device.partition(":")[0]


def stories(measurers) -> list[list[StoryMeasurer]]:
    """Return the measurers that are played to, by the story they share."""
    together: dict[Any, list[StoryMeasurer]] = {}
    for measurer in measurers:
        if isinstance(measurer, StoryMeasurer):
            together.setdefault(measurer.story, []).append(measurer)
    return list(together.values())


def staged(scene, story: list[StoryMeasurer]):
    """Return the scene to be played for measurers of one story."""
    return with_test_particles(scene, story) if isinstance(story[0], ParticleMeasurer) else story[0].staged(scene)
