"""Parts that fall on, beside and into parts, and are pushed by an arm: nothing comes from nowhere.

Random scenes by a seed on the stepped robot; `tools/hunt.py` tries more of them.
"""

from __future__ import annotations

from collections.abc import Callable
from math import nan

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iiwa_sim.contact.shapes import Box, Cylinder, Shape, Sphere
from iiwa_sim.handling.falling import LIES
from iiwa_sim.handling.part import Part, Z
from tests.handling.books import ROUNDING_J
from tests.handling.depths import deepest_mm
from tests.handling.heaps import LOW_MM, HeapScene, heap, row, straight_row
from tests.handling.scenes import TABLE_MM
from tests.samples import some

BENT = 0.02
"""Part of the arm's work on what it carries, which is found by the forces at the beginning and end of each
tick."""
TURNED = 1e-6
"""Part of the arm's work: where what is held rubs on what is round and turns below it, a tick's way along
that is known so well; 1e-7 J at most, in few scenes."""
OFF = 0.02
"""Part of an impulse: many parts in a row may not be in balance yet when a tick ends, and the arm does not
feel what is taken from the parts' speed, so that they gain no energy."""
LEAST_NS = 1e-3
DEEP_MM = 1.5
"""Besides what the upper one has sunk in by its weight: heights that differ by 1 mm count as the same, and
what is in by 0.5 mm stays so."""


def falls(seed: int) -> dict[str, float]:
    """Nobody pushes: all goes straight down, and rests, none in another."""
    scene = heaped(seed)
    scene.falls()
    assert scene.fastest < 1e-9, "nobody has pushed"
    deep_mm = deepest_mm(scene.books.pieces)
    assert deep_mm < DEEP_MM, f"parts are {deep_mm:.1f} mm in each other"
    return {**check(scene), "in each other, mm": deep_mm}


def ploughs(seed: int) -> dict[str, float]:
    """Parts fall on and beside each other, and then an arm goes through the heap."""
    scene = heaped(seed)
    scene.falls()
    scene.goes_through()
    return check(scene)


def rows(seed: int, *, stacks: bool = False) -> dict[str, float]:
    """Parts that stand beside each other, and an arm that goes through them."""
    rng = np.random.default_rng(seed)
    scene = HeapScene(rng, row(rng, stacks=stacks))
    scene.goes_through()
    return check(scene)


def stacks(seed: int) -> dict[str, float]:
    """Parts that stand beside each other with others on top of them, and an arm that goes through them."""
    return rows(seed, stacks=True)


def carried(seed: int) -> dict[str, float]:
    """A box in the jaws goes through a row, a little above the table."""
    return goes_with(seed, Box)


def round_carried(seed: int) -> dict[str, float]:
    """So does a ball, or a cylinder that stands."""

    def in_jaws(a: float, _b: float, c: float) -> Shape:
        return Sphere(c) if seed % 2 else Cylinder(a, c)

    return goes_with(seed, in_jaws)


def goes_with(seed: int, in_jaws: Callable[[float, float, float], Shape]) -> dict[str, float]:
    """A part of a shape, of half its edges, goes through a row."""
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(0.008, 0.03, 3).tolist()
    it = Part(
        "it", in_jaws(a, b, c), float(rng.uniform(0.05, 1.0)), 1.0, float(10.0 ** rng.uniform(4.0, 5.5))
    )
    scene = HeapScene(rng, row(rng), it)
    scene.goes_along(
        600.0 + float(rng.uniform(-30.0, 30.0)), TABLE_MM + 1e3 * c + float(rng.uniform(3.0, 20.0))
    )
    scene.rests()
    return check_carried(scene)


def put_down(seed: int) -> dict[str, float]:
    """A box or a cylinder in the jaws is pressed from above on parts that are turned anyhow, is moved along
    there, and is lifted."""
    rng = np.random.default_rng(seed)
    a, b, c = rng.uniform(0.008, 0.03, 3).tolist()
    shape = Cylinder(a, c) if seed % 3 == 0 else Box(a, b, c)
    it = Part("it", shape, float(rng.uniform(0.05, 1.0)), 1.0, float(10.0 ** rng.uniform(4.0, 5.5)))
    placed = row(rng)
    scene = HeapScene(rng, placed, it)
    part, where = placed[rng.integers(len(placed))]
    x_mm, y_mm, z_mm = (1e3 * each for each in where.translation)
    top_mm = z_mm + 1e3 * (part.reach(where.rotation, Z) + c)
    x_mm, y_mm = x_mm + float(rng.uniform(-20.0, 20.0)), y_mm + float(rng.uniform(-20.0, 20.0))
    scene.goes_down(x_mm, y_mm, top_mm, float(rng.uniform(0.1, 3.0)))
    scene.rests()
    return check_carried(scene, TURNED)


def impulses(seed: int) -> dict[str, float]:
    """A straight row of smooth parts: what the arm feels is what the parts get, as long as all lie."""
    rng = np.random.default_rng(seed)
    scene = Pushed(rng, straight_row(rng))
    scene.pushes(600.0, LOW_MM)
    most = max(scene.felt_ns, LEAST_NS)
    assert scene.off_ns <= OFF * most, f"{scene.off_ns:.3g} Ns of {most:.3g} Ns in tick {scene.tick}"
    return {"impulse that nobody got": scene.off_ns / most, "felt, Ns": scene.felt_ns}


class Pushed(HeapScene):
    """With the impulse along y that the arm gives, and that the parts have."""

    off_ns = felt_ns = 0.0
    """The most that they differed, and the most that it was (N s)."""
    _given_ns = 0.0
    tick = 0
    """When they differed by that."""

    def step(self, ticks: int = 1) -> None:
        for _ in range(ticks):
            self.scene.robot.step()
            bodies = self.books.pieces.bodies.values()
            if any(each.state != LIES for each in bodies):
                self._given_ns = nan  # from now on
            contacts = self.scene.controller.load.link_contacts
            self._given_ns -= self.scene.controller.tick_s * sum(each.force[1] for each in contacts)
            has_ns = sum(each.part.mass_kg * each.velocity[1] for each in bodies)
            if abs(has_ns - self._given_ns) > self.off_ns:
                self.off_ns, self.tick = abs(has_ns - self._given_ns), len(self.scene.robot.joints) - 1
            if abs(self._given_ns) > self.felt_ns:
                self.felt_ns = abs(self._given_ns)


def heaped(seed: int) -> HeapScene:
    rng = np.random.default_rng(seed)
    return HeapScene(rng, heap(rng))


def check(scene: HeapScene) -> dict[str, float]:
    """Nothing comes from nowhere."""
    books = scene.books
    assert books.returned_j <= ROUNDING_J, (
        f"{books.returned_j:.3g} J of the arm's {books.arm_j:.3g} J, first in {books.told}"
    )
    return {"returned, J": books.returned_j, "fastest, m/s": scene.fastest}


def check_carried(scene: HeapScene, part: float = 0.0) -> dict[str, float]:
    """All others get no more than what is held gives, but for that part of the arm's work, and all together
    no more than the arm does."""
    books = scene.books
    returned_j = books.but_held.returned_j
    assert returned_j <= ROUNDING_J + part * books.arm_j, (
        f"{returned_j:.3g} J of the arm's {books.arm_j:.3g} J"
    )
    assert books.returned_j <= ROUNDING_J + BENT * books.arm_j, (
        f"{books.returned_j:.3g} J of the arm's {books.arm_j:.3g} J, first in {books.told}"
    )
    share = returned_j / books.arm_j if books.arm_j else 0.0
    return {
        "returned by what is held, J": returned_j,
        "of the arm's work": share,
        "fastest, m/s": scene.fastest,
    }


@settings(max_examples=some(40), deadline=None)
@given(st.integers(0, 10**6))
def test_what_falls_on_beside_and_into_others_goes_straight_down_and_gains_nothing(seed: int) -> None:
    """Whatever is lifted, taken away, let go or brought back meanwhile."""
    falls(seed)


@pytest.mark.parametrize("seed", [1200609, 1300486])
def test_what_jaws_bring_between_them_pushes_nothing_in_a_scene_in_which_nobody_pushes(seed: int) -> None:
    falls(seed)


@pytest.mark.parametrize("seed", [1311087, 1311196])
def test_a_heavy_part_sinks_into_a_soft_one_by_its_weight_over_the_stiffness(seed: int) -> None:
    """By more than any two parts are in each other besides that."""
    falls(seed)


@pytest.mark.slow
@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10**6))
def test_an_arm_that_goes_through_a_row_gives_all_that_its_parts_get(seed: int) -> None:
    """Motion, height and springs of all parts have no more than the work of the arm, by what it feels."""
    rows(seed)


@pytest.mark.parametrize(("scene", "seed"), [(ploughs, 1601683), (ploughs, 1620061)])
def test_arm_and_parts_agree_by_which_way_a_jaw_has_come_in(
    scene: Callable[[int], object], seed: int
) -> None:
    """Once 1 % of the arm's work came from nowhere: it pushed again what had been beside it for a moment."""
    scene(seed)


@pytest.mark.parametrize("seed", [1600734, 1600035, 1600094])
def test_a_jaw_gives_what_it_feels_where_it_is_deepest_when_parts_have_gone(seed: int) -> None:
    """Once up to 1.2 % of the arm's work came from nowhere, most of it by friction."""
    rows(seed)


@pytest.mark.parametrize("seed", [1600975, 1620282])
def test_a_jaw_that_slides_over_an_edge_is_not_pushed_on_for_nothing(seed: int) -> None:
    rows(seed)


@pytest.mark.parametrize("seed", [1610097, 1610100, 1610113])
def test_what_lies_on_a_part_gets_no_more_of_a_jaw_than_the_arm_gives(seed: int) -> None:
    """Once up to 2.4 % of its work came from nowhere."""
    stacks(seed)


def test_what_is_squeezed_aside_comes_to_rest() -> None:
    """Once it crept on for more than 24 s: friction's springs below it were not wound by a part of a way."""
    scene = HeapScene(rng := np.random.default_rng(1601069), row(rng, stacks=True))
    scene.goes_through()
    assert not any(scene.moving())


@pytest.mark.parametrize("seed", [1501469, 1600718])
def test_what_falls_over_an_edge_and_finds_no_room_lies_there_as_pressed_in_as_before(seed: int) -> None:
    """What its spring stores is not lost by that, and does not come back."""
    ploughs(seed)


def test_what_lands_on_what_slides_on_a_part_that_slides_slows_both() -> None:
    """Once 0.04 % of the arm's work came from nowhere: only the upper one got slower."""
    ploughs(2100094)


def test_what_lies_on_a_part_that_jaws_take_away_gains_nothing_when_it_begins_to_fall() -> None:
    """A tick after that part is gone: until then it is as pressed in as it was."""
    ploughs(2000513)


def test_what_a_part_cannot_pay_by_its_speed_the_arm_presses_less() -> None:
    """Once 6.6 % of the arm's work came from nowhere: jaws went down over the edge of a part that stood."""
    ploughs(1601230)


def test_what_is_carried_through_the_air_takes_and_gives_the_work_of_the_arm() -> None:
    """By the mean of the torques before and after a tick; by those after it three times as much came back."""
    scene = HeapScene(np.random.default_rng(0), [], Part("it", Box(0.02, 0.02, 0.02), 1.0, 1.0, 1e5))
    scene.goes_along(600.0, TABLE_MM + 60.0)
    assert scene.books.arm_j > 1.0
    assert scene.books.returned_j < 0.0025 * scene.books.arm_j


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(st.integers(0, 10**6))
def test_what_is_held_gives_a_row_no_more_than_the_arm_does(seed: int) -> None:
    """By force and torque at the flange, with the weight and the motion of what is held in the books."""
    carried(seed)
    round_carried(seed)


@pytest.mark.slow
@settings(max_examples=5, deadline=None)
@given(st.integers(0, 10**6))
def test_what_is_put_down_gives_what_is_below_no_more_than_the_arm_does(seed: int) -> None:
    """Whether its corners are over that, or beside it."""
    put_down(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9400210, 9400225, 9400283])
def test_what_others_press_up_by_their_corners_slides_in_the_jaws(seed: int) -> None:
    """Once 5 % of the arm's work and more came from nowhere: it stayed where it was in the jaws, which held
    less than the parts below pressed."""
    put_down(seed)


@pytest.mark.slow
def test_what_is_beside_a_held_part_presses_on_when_that_is_pressed_down_past_it() -> None:
    """Once 4 mJ were lost and came back: it did so only where the part was over it by more than 1 mm."""
    put_down(9400446)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [9600200, 9730017])
def test_what_goes_past_an_edge_is_not_felt_until_it_presses_anew(seed: int) -> None:
    """Once 5 mJ came from nowhere: the held part felt there what the part below had not been pressed by."""
    put_down(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1610104, 1620115])
def test_parts_get_the_friction_and_the_depth_that_what_is_held_feels(seed: int) -> None:
    """Once 0.1 % of the arm's work came from nowhere: two kernels found how deep places are, and by which way
    they have come in, and each had the rest of friction on a bent surface in its own way."""
    carried(seed)


@pytest.mark.slow
def test_what_falls_over_an_edge_is_felt_by_what_has_pressed_it_there() -> None:
    """Once 30 uJ came from nowhere in that tick."""
    carried(1625152)


@pytest.mark.slow
def test_a_ball_in_the_jaws_feels_the_corners_of_others_where_these_have_gone() -> None:
    """Once 2 % of the arm's work came from nowhere: it felt none of them for some ticks."""
    round_carried(1700061)


@settings(max_examples=some(15), deadline=None)
@given(st.integers(0, 10**6))
def test_what_the_arm_feels_is_what_a_row_gets(seed: int) -> None:
    impulses(seed)


@pytest.mark.parametrize("seed", [2093, 2211, 1200035])
def test_a_box_narrower_than_the_jaw_gets_what_the_arm_feels_at_its_edges(seed: int) -> None:
    """Once up to 18 % of that nobody got: the way out was that of before the tick."""
    impulses(seed)


def test_light_stiff_parts_in_a_row_get_what_the_arm_feels() -> None:
    """Once 3 % of that nobody got: the balance was not found yet when the tick ended."""
    impulses(910001)


@pytest.mark.parametrize("seed", [1200002, 1200099])
def test_a_part_that_turns_round_a_jaw_gets_the_work_of_the_arm(seed: int) -> None:
    """Once up to 27 % of that came from nowhere: its corner goes on an arc, and was taken to go straight."""
    rows(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1210010, 1500533])
def test_what_lands_in_a_held_part_is_not_thrown_out_of_it(seed: int) -> None:
    """Once up to 15 % of the arm's work came from nowhere: as what is held went on, more of that pressed."""
    carried(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1500222, 1500463])
def test_a_part_gets_the_friction_that_a_held_one_feels(seed: int) -> None:
    """Once up to 8 % of the arm's work came from nowhere: what spun drew the arm along, and spun on."""
    carried(seed)


@pytest.mark.slow
def test_a_corner_at_an_edge_of_a_held_part_is_pushed_out() -> None:
    """Once a part that could leave only past that edge stood still in what went through it, by 27 mm."""
    carried(1500485)


@pytest.mark.parametrize(("scene", "seed"), [(rows, 1200043), (stacks, 1210172)])
def test_parts_get_no_work_that_the_arm_does_not_feel(scene: Callable[[int], object], seed: int) -> None:
    """Once up to 5 % of its work came from nowhere: in kicks that end within a tick, and at corners."""
    scene(seed)


@pytest.mark.parametrize(("scene", "seed"), [(stacks, 118), (stacks, 1220025)])
def test_what_lies_on_a_part_is_lifted_by_the_arm_alone(scene: Callable[[int], object], seed: int) -> None:
    """Once the spring below a part lifted that for nothing: up to 7 % of the work came from nowhere."""
    scene(seed)


@pytest.mark.slow
def test_what_lands_sliding_is_felt_where_it_is() -> None:
    """Once the arm took it to be where it had landed: 1.6 J came from nowhere."""
    stacks(101)
