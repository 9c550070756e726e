"""Orders: balanced where they should be, the same for the same seed, each condition once."""

import itertools
from collections import Counter

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.study.allocation import allocate, block_size, williams
from shared.study.protocol import Condition, Order, Protocol, Section
from shared.study.protocol_file import load_protocol, problems_of, shipped_protocol

TEMPLATE = load_protocol(shipped_protocol("template"))


def protocol_with(conditions: int, first: int, kind: str) -> Protocol:
    names = [f"c{number}" for number in range(conditions)]
    made = msgspec.structs.replace(
        TEMPLATE,
        condition=tuple(Condition(name=name, player="scripted:static") for name in names),
        section=(Section(games=1, rest=0.0),) * conditions,
        order=Order(kind=kind, first=tuple(names[:first])),
    )
    assert not list(problems_of(made))
    return made


@st.composite
def protocols(draw, kinds=("random", "williams")):
    conditions = draw(st.integers(2, 9))
    first = draw(st.integers(0, conditions - 2))
    return protocol_with(conditions, first, draw(st.sampled_from(kinds)))


def check_balance(orders, n):
    """Each on each place, and each ordered pair of neighbours, equally often."""
    places = Counter((place, value) for row in orders for place, value in enumerate(row))
    assert len(places) == n * n
    assert len(set(places.values())) == 1
    pairs = Counter(pair for row in orders for pair in itertools.pairwise(row))
    assert len(pairs) == n * (n - 1)
    assert len(set(pairs.values())) == 1


@settings(max_examples=25, deadline=None)
@given(st.integers(2, 12))
def test_a_williams_design_is_balanced_on_places_and_on_neighbours(n):
    rows = williams(n)
    assert len(rows) == (n if n % 2 == 0 else 2 * n)
    check_balance(rows, n)


@settings(max_examples=20, deadline=None)
@given(protocols(kinds=("williams",)), st.integers(1, 3), st.integers(0, 2**31))
def test_whole_blocks_of_people_are_balanced(protocol, blocks, seed):
    made = allocate(protocol, blocks * block_size(protocol), seed)
    first = len(protocol.order.first)
    free = [order[first:] for _, order in made.assignments]
    check_balance(free, len(protocol.condition) - first)


@settings(max_examples=20, deadline=None)
@given(protocols(), st.integers(1, 40), st.integers(0, 2**31))
def test_everybody_meets_each_condition_once_and_the_first_ones_first(protocol, people, seed):
    made = allocate(protocol, people, seed)
    names = [condition.name for condition in protocol.condition]
    assert sorted(made.labels.values()) == sorted(names)
    assert len({participant for participant, _ in made.assignments}) == people
    for _, order in made.assignments:
        met = [made.labels[label] for label in order]
        assert sorted(met) == sorted(names)
        assert tuple(met[: len(protocol.order.first)]) == protocol.order.first


@settings(max_examples=20, deadline=None)
@given(protocols(), st.integers(1, 30), st.integers(0, 30), st.integers(0, 2**31))
def test_a_seed_says_it_all_and_more_people_change_no_ones_order(protocol, people, more, seed):
    made = allocate(protocol, people, seed)
    assert made == allocate(protocol, people, seed)
    longer = allocate(protocol, people + more, seed)
    assert longer.labels == made.labels
    assert longer.assignments[:people] == made.assignments


def test_random_orders_take_every_order_about_equally_often():
    made = allocate(load_protocol(shipped_protocol("study-one")), 6000, 11)
    counts = Counter(order for _, order in made.assignments)
    assert len(counts) == 6
    # Binomial, 6000 draws at 1/6: mean 1000, standard deviation 29.
    assert all(abs(count - 1000) < 5 * 29 for count in counts.values())
    # What the letters stand for is drawn, too.
    firsts = {next(iter(allocate(TEMPLATE, 1, seed).labels.values())) for seed in range(20)}
    assert len(firsts) == 3
