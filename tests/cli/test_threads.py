"""--threads: what is a number of cores, and what is said of what is none."""

import pytest

from warpsim import cores
from warpsim.cli.outcome import Exit, Failure
from warpsim.cli.threads import thread_count


@pytest.fixture(autouse=True)
def four_cores(monkeypatch):
    monkeypatch.setattr(cores, "available_cores", lambda: 4)


@pytest.mark.parametrize("text, expected", [(None, None), ("1", 1), ("4", 4), ("03", 3)])
def test_numbers_of_cores_are_taken_without_a_word(text, expected):
    notes = []
    assert thread_count(text, notes.append) == expected and not notes


@pytest.mark.parametrize("text", ["5", "1024", "999999999"])
def test_more_than_there_are_is_told_and_all_of_them(text):
    notes = []
    assert thread_count(text, notes.append) == 4
    assert len(notes) == 1 and f"--threads {text}" in notes[0] and "4 cores" in notes[0]


@pytest.mark.parametrize("text", ["0", "-3", "two", "1.5", "", " 2", "+2", "1e2", "2 cores", "9" * 400])
def test_what_is_no_number_of_cores_is_refused_with_what_is(text):
    with pytest.raises(Failure, match="from 1 on; this process may use 4") as failure:
        thread_count(text, pytest.fail)
    assert failure.value.code == Exit.USAGE
