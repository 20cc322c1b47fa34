"""How much of a server's time one client may take, in simulated time."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.serve.allowance import AT_ONCE_S, MOST_CLIENTS, SHARE, Allowance, Allowances

COSTS = st.lists(st.floats(1e-6, 0.02), min_size=1, max_size=300)


def heard(costs: list[float], gaps: list[float]) -> list[tuple[float, float]]:
    """When each message was begun and ended: each is there `gap` after the one before, or waits already."""
    allowance, now_s, turns = Allowance(), 100.0, []
    for cost, gap in zip(costs, gaps, strict=True):
        begun_s = now_s + gap
        now_s = begun_s + cost
        turns.append((begun_s, now_s))
        now_s += allowance.rest_s(cost, now_s)
    return turns


@given(COSTS, st.data())
def test_however_a_client_floods_it_takes_no_more_than_its_share(
    costs: list[float], data: st.DataObject
) -> None:
    gaps = data.draw(st.lists(st.floats(0.0, 0.5), min_size=len(costs), max_size=len(costs)))
    turns = heard(costs, gaps)
    first = data.draw(st.integers(0, len(costs) - 1))
    last = data.draw(st.integers(first, len(costs) - 1))
    took = sum(costs[first : last + 1])
    interval = turns[last][1] - turns[first][0]
    assert took <= SHARE * interval + AT_ONCE_S + max(costs[first : last + 1]) + 1e-9


@settings(max_examples=20)
@given(st.floats(5e-5, 1e-3))
def test_many_short_messages_are_a_flood_like_few_long_ones(cost: float) -> None:
    count = round(1.0 / cost)
    (begun, _), *_, (_, ended) = heard([cost] * count, [0.0] * count)
    assert ended - begun > 0.95 / SHARE, "a second of listening takes some twenty"


def test_who_keeps_to_the_share_never_waits() -> None:
    allowance = Allowance()
    rests = [allowance.rest_s(0.0004, 0.01 * k) for k in range(1000)]  # 0.4 ms, 100 times a second
    assert not any(rests)


def test_who_was_quiet_may_take_a_little_at_once() -> None:
    allowance = Allowance()
    rests = [allowance.rest_s(0.0001, 50.0 + 0.0001 * k) for k in range(40)]
    assert not any(rests)
    assert allowance.rest_s(0.05, 51.0) > 0.8


def test_clients_are_told_from_each_other_by_name() -> None:
    allowances, alone = Allowances(), Allowance()
    for k in range(20):
        now_s = 50.0 + 0.001 * k
        assert allowances.rest_s("flooder", 0.01, now_s) == alone.rest_s(0.01, now_s)
        assert allowances.rest_s(f"other {k}", 0.001, now_s) == 0.0


def test_of_many_clients_the_last_are_remembered() -> None:
    allowances = Allowances()
    before = allowances.rest_s("flooder", 1.0, 50.0)
    for k in range(MOST_CLIENTS - 1):
        allowances.rest_s(f"other {k}", 0.001, 50.0)
    assert allowances.rest_s("flooder", 1.0, 50.0) > before
    for k in range(MOST_CLIENTS):
        allowances.rest_s(f"other {k}", 0.001, 50.0)
    assert allowances.rest_s("flooder", 1.0, 50.0) == before
