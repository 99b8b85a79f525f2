"""Stages on their own: what a system's parts do, asked without a frame round them."""

from collections.abc import Iterable
from dataclasses import replace
from unittest import mock

import warp as wp

from warpsim import launch
from warpsim.launch import FrameGraph, Stage


def carry_out(stages: Iterable[Stage], device="cpu", cores=1, native=True) -> None:
    """Carry stages out once; all the cores share each of them, however few the elements."""
    graph = FrameGraph([replace(stage, of="these") for stage in stages], device, cores, native)
    with mock.patch.object(launch, "PARALLEL_FROM", 0):
        graph.run({})
    assert graph.cores == graph.core_count
    wp.synchronize_device(device)
