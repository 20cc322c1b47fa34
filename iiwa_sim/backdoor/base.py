"""The base of the backdoor: the robot and its surroundings, and calls in the simulator's event loop."""

from collections.abc import Callable, Sequence
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from iiwa_sim.backdoor.described import MovesDescriber
from iiwa_sim.backdoor.outside import Entrance
from iiwa_sim.backdoor.recent_dialogue import RecentDialogue
from iiwa_sim.backdoor.states import States
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.dialect.wire.wire_faults import WireFaults
from iiwa_sim.wording import harmless, shortened

LONGEST_TOLD = 200
"""Characters of a call, as listeners are told it."""
MOST_MOVES = 50
"""Moves that `moves` tells at most, of those that run and wait."""

C = TypeVar("C", bound="Base")
P = ParamSpec("P")
T = TypeVar("T")


class Call(Protocol):
    """Calls a function in the simulator's event loop; returns its result, or raises what it raises."""

    def __call__(self, function: Callable[[], T]) -> T: ...


def _at_once(function: Callable[[], T]) -> T:
    return function()


def called(method: Callable[Concatenate[C, P], T]) -> Callable[Concatenate[C, P], T]:
    """Decorator: the method runs in the simulator's event loop, between two ticks."""

    @wraps(method)
    def call(self: C, /, *args: P.args, **kwargs: P.kwargs) -> T:
        return self.call(lambda: method(self, *args, **kwargs))

    return call


def acts(method: Callable[Concatenate[C, P], T]) -> Callable[Concatenate[C, P], T]:
    """Decorator: the method changes something; it runs between two ticks, and listeners are told of it."""

    @wraps(method)
    def act(self: C, /, *args: P.args, **kwargs: P.kwargs) -> T:
        done = method(self, *args, **kwargs)
        if self.listeners:
            given = [*map(repr, args), *(f"{name}={value!r}" for name, value in kwargs.items())]
            text = harmless(shortened(f"{method.__name__}({', '.join(given)})", LONGEST_TOLD))
            for listener in self.listeners:
                listener(text)
        return done

    return called(act)


class Base:
    """What the backdoor manipulates."""

    def __init__(
        self,
        controller: Controller,
        wire: WireFaults,
        entrances: Sequence[Entrance],
        clock: Clock,
        recent: RecentDialogue,
        call: Call = _at_once,
    ) -> None:
        """`entrances` are the ports of all dialects."""
        self.call = call
        self.listeners: list[Callable[[str], None]] = []
        """Told of each call that has changed something, as text."""
        self._controller = controller
        self._wire = wire
        self._entrances = entrances
        self._clock = clock
        self._recent = recent
        self._states = States(controller)
        self._moves = MovesDescriber(controller, MOST_MOVES)

    @property
    def joint_count(self) -> int:
        """Number of joints of the robot."""
        return len(self._controller.description.joints)
