"""A storm of hostile connections on a running simulation; `python -m tests.viewer.storm --connects 2000` prints the full figures."""

import sys

import pytest

from tests.viewer.storm import measure


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_two_hundred_hostile_connections_slow_no_run_and_hold_no_memory():
    figures = measure(connects=200, threads=8, calm_seconds=1.5)
    assert figures["memory_grown_mb"] <= 64
    # At 40 connections a second the bar, 0.9 of the steps by the clock of a machine with nothing else to do, leaves 2.5 ms to each.
    assert figures["milliseconds_of_processor_per_connection"] <= 10.0
