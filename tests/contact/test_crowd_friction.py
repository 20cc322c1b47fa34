"""What is kept of the friction between parts that push each other: it holds for as long as it is asked to."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.crowd import PartMotion, PressingBall
from iiwa_sim.contact.shapes import Box
from iiwa_sim.contact.surface import Surface
from iiwa_sim.frames import IDENTITY
from tests.contact.floor import CUBE, FRICTION, Floor, G
from tests.samples import some

HALF = 0.02
STIFFNESS = 5e4
TABLE_N = FRICTION * 0.2 * G
WALL = Surface(
    "wall", Box(0.02, 0.3, 0.1), IDENTITY._replace(translation=(0.0, 0.0, 0.0)), STIFFNESS, 0.0, 1.0
)


class Row:
    """Cubes in a row along x, pressed onto a wall by a ball with a force that stays, and one of them pushed
    along y by another. Both balls are smooth."""

    def __init__(self, count: int, pressed_n: float) -> None:
        self.floor = Floor(WALL)
        for number in range(count):
            self.floor.put(CUBE, 0.02 + HALF + 2.0 * HALF * number, 0.0)
        self.floor.begin()
        self._pressed_n = pressed_n

    def step(self, number: int = 0, pushed_n: float = 0.0) -> list[PartMotion]:
        """A tick in which one is pushed."""
        last = len(self.floor.laid) - 1
        balls = [(last, self._ball(last, 0, self._pressed_n))]
        if pushed_n:
            balls.append((number, self._ball(number, 1, pushed_n)))
        return self.floor.step(*balls)

    def _ball(self, number: int, axis: int, force_n: float) -> PressingBall:
        """As deep in a cube as that takes, wherever it is: from far along x, or from below along y."""
        at = list(self.place(number))
        far = HALF + 0.01 - force_n / STIFFNESS
        at[axis] += far if axis == 0 else -far
        return PressingBall((at[0], at[1], at[2]), 0.01, STIFFNESS)

    def place(self, number: int) -> tuple[float, float, float]:
        return self.floor.laid[number].solid.pose.translation

    def rests(self, ticks: int = 300) -> None:
        """Pressed, and not pushed."""
        for _ in range(ticks):
            self.step()


@settings(max_examples=some(15), deadline=None)
@given(count=st.integers(1, 4), pressed_n=st.floats(5.0, 60.0), share=st.floats(0.1, 0.6))
def test_what_is_pushed_less_than_friction_holds_does_not_creep(
    count: int, pressed_n: float, share: float
) -> None:
    """However long: the cube at the wall gives way as springs do, and stays there."""
    row = Row(count, pressed_n)
    row.rests()
    began = row.place(0)[1]
    # The wall holds on one side; of what the next one holds nothing is counted.
    pushed_n = share * (FRICTION * pressed_n + TABLE_N)
    for _ in range(1200):
        row.step(0, pushed_n)
    there = row.place(0)[1]
    assert abs(there - began) < 2e-3
    for _ in range(400):
        row.step(0, pushed_n)
    assert abs(row.place(0)[1] - there) < 1e-6


@settings(max_examples=some(10), deadline=None)
@given(count=st.integers(1, 4), pressed_n=st.floats(5.0, 40.0), more=st.floats(1.3, 3.0))
def test_what_is_pushed_more_slides(count: int, pressed_n: float, more: float) -> None:
    row = Row(count, pressed_n)
    row.rests()
    began = row.place(0)
    sides = 1 if count == 1 else 2
    pushed_n = more * (sides * FRICTION * pressed_n + TABLE_N + (count - 1) * TABLE_N)
    for _ in range(300):
        row.step(0, pushed_n)
    assert row.place(0)[1] - began[1] > 5e-3


def test_kept_friction_goes_on_with_the_same_bits_and_forgotten_friction_does_not() -> None:
    """A cube of a row, pushed along: what its neighbours hold is remembered with the places at which they
    meet."""
    row = Row(3, 40.0)
    row.rests()
    for _ in range(50):
        row.step(1, 15.0)
    kept, before = row.floor.crowd.kept(), list(row.floor.laid)

    def goes_on() -> list[list[PartMotion]]:
        row.floor.laid = list(before)
        for number, laid in enumerate(before):
            row.floor.crowd.lay(number, laid)
        return [row.step(1, 15.0) for _ in range(20)]

    once = goes_on()
    row.floor.crowd.restore(kept)
    assert goes_on() == once
    row.floor.crowd.forget()
    assert goes_on() != once
