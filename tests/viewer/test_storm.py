"""A storm of hostile connections on a running simulation; `python -m tests.viewer.storm --connects 2000` prints the full figures."""

import sys

import pytest

from tests.viewer.storm import measure


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_two_hundred_hostile_connections_slow_no_run_and_hold_no_memory():
    figures = measure(connects=200, threads=8, calm_seconds=1.5)
    assert figures["memory_grown_mb"] <= 64
    assert figures["share_kept_of_the_processor"] >= 0.75, "the bar is 0.9 of the clock, on a machine with nothing else to do"
