"""The base of the backdoor: the robot and its surroundings, and calls in the simulator's event loop."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from iiwa_sim.backdoor.states import States
from iiwa_sim.clock.clock import Clock
from iiwa_sim.controller.controller import Controller
from iiwa_sim.controller.errors import Refused
from iiwa_sim.dialogue import Dialogue
from iiwa_sim.protocols.faults import WireFaults
from iiwa_sim.server.listening import Acceptor
from iiwa_sim.wording import harmless, shortened

LONGEST_TOLD = 200
"""Characters of a call, as listeners are told it."""

HERE = "backdoor"
"""The name in the dialogue of a program that has the simulator in its own process and acts."""
DRAGGED = ("push", "push_joints", "move_surface")
"""Methods that a client calls many times a second while somebody drags the arm."""
DRAGGED_S = 1.0
"""Time (s) in which the dialogue has at most one of these calls."""

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
        given = [*map(repr, args), *(f"{name}={value!r}" for name, value in kwargs.items())]
        text = harmless(shortened(f"{method.__name__}({', '.join(given)})", LONGEST_TOLD))
        try:
            done = method(self, *args, **kwargs)
        except Refused as refused:
            self._tell(text, f"{refused.code} {refused.reason}")
            raise
        for listener in self.listeners:
            listener(text)
        if method.__name__ not in DRAGGED or self._drags_anew(method.__name__):
            self._tell(text)
        return done

    return called(act)


class Base:
    """What the backdoor manipulates."""

    def __init__(
        self,
        controller: Controller,
        wire: WireFaults,
        ports: Callable[[], Sequence[Acceptor]],
        clock: Clock,
        dialogue: Dialogue,
        call: Call = _at_once,
    ) -> None:
        """`ports` gives the listening ports of all protocols."""
        self.call = call
        self.listeners: list[Callable[[str], None]] = []
        """Told of each call that has changed something, as text."""
        self._controller = controller
        self._wire = wire
        self._ports = ports
        self._clock = clock
        self._dialogue = dialogue
        self._states = States(controller)
        self._client = HERE
        self._dragged: dict[str, float] = {}  # when the dialogue has a call of this method again

    @contextmanager
    def by(self, client: str) -> Iterator[None]:
        """Name a client in the dialogue as the one that acts meanwhile."""
        self._client = client
        try:
            yield
        finally:
            self._client = HERE

    def _tell(self, text: str, reason: str = "") -> None:
        self._dialogue.event(self._client, text, reason=reason)

    def _drags_anew(self, name: str) -> bool:
        now_s = time.monotonic()
        anew = now_s >= self._dragged.get(name, now_s)
        if anew:
            self._dragged[name] = now_s + DRAGGED_S
        return anew

    @property
    def joint_count(self) -> int:
        """Number of joints of the robot."""
        return len(self._controller.description.joints)
