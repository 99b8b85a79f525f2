"""Sharing: a plan is the fastest of those thought of, by times that are known, and one core is not left for nothing."""

import pytest

from warpsim.sharing import HANDING_OUT, MEETING, OFFSET, Measured, Plan, best_plan, joint, single


def test_small_work_stays_with_one_core():
    work = {"a": 8e-6, "b": 8e-6}
    assert best_plan(work, {"a": 5, "b": 5}, 2) == single(["a", "b"])


def test_large_work_is_shared():
    assert best_plan({"a": 5e-3}, {"a": 40}, 2) == joint(["a"], 2)


def test_work_that_meets_too_often_is_not_shared():
    meetings = int(5e-4 / MEETING)
    assert best_plan({"a": 5e-4}, {"a": meetings}, 2) == single(["a"])


def test_many_small_companies_are_divided_up_beside_a_large_one_that_is_shared():
    work = {"large": 2e-3} | {f"small{k}": 30e-6 for k in range(10)}
    plan = best_plan(work, dict.fromkeys(work, 40), 2)
    assert plan.shared == ("large",)
    assert [len(names) for names in plan.own] == [5, 5]
    assert plan.cost(work, dict.fromkeys(work, 40)) == pytest.approx(1e-3 + 150e-6 + 40 * MEETING + HANDING_OUT)


def test_alike_companies_are_divided_up_rather_than_shared_if_that_leaves_nobody_idle():
    """Meetings cost; of five on two cores the odd one is shared."""
    assert best_plan(dict.fromkeys("ab", 2e-4), dict.fromkeys("ab", 34), 2) == Plan((), (("a",), ("b",)))
    plan = best_plan(dict.fromkeys("abcde", 2e-4), dict.fromkeys("abcde", 34), 2)
    assert len(plan.shared) == 1 and [len(names) for names in plan.own] == [2, 2]


def test_unequal_companies_are_divided_up_evenly():
    plan = best_plan({"a": 4e-4, "b": 3e-4, "c": 3e-4, "d": 2e-4}, dict.fromkeys("abcd", 1000), 2)
    assert sorted(map(set, plan.own), key=min) == [{"a", "d"}, {"b", "c"}]


def test_what_is_known_grows_with_what_there_is():
    measured = Measured(["a", "b"])
    assert measured.work({"a": 0, "b": 0}) is None
    for seconds in (9e-6, 2e-6, 2e-6):  # a first frame finds its memory cold
        measured.told("a", seconds, 1000 - OFFSET)
        measured.told("b", 1e-6, 0)
    assert measured.known
    assert measured.work({"a": 10_000 - OFFSET, "b": 0}) == pytest.approx({"a": 20e-6, "b": 1e-6})


def test_one_look_is_enough_for_much():
    measured = Measured(["a"])
    measured.told("a", 1e-2, 1000)
    assert not measured.known
    assert measured.work({"a": 1000}) == pytest.approx({"a": 1e-2})
    assert measured.work({"a": 0}) == pytest.approx({"a": 1e-2 * OFFSET / (1000 + OFFSET)})


def test_plans_are_compared_by_what_they_are():
    assert Plan(("a",), ((), ())) == joint(["a"], 2) and hash(joint(["a"], 2)) == hash(joint(["a"], 2))
