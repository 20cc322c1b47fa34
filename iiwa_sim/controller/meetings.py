"""What the links of the arm, and what it wears, meet: told once, when it begins."""

from collections.abc import Callable

import msgspec

from iiwa_sim.contact.link_forces_kernel import LinkContact
from iiwa_sim.contact.load_kernel import ExternalLoad
from iiwa_sim.frames import Vector
from iiwa_sim.wording import harmless

SELF_COLLISION_EVERY_S = 0.1
"""Time (s, simulated) between two looks at a moving arm for links that are in each other."""


NAMED = {"tip": "the sphere round the TCP"}
"""What is fixed to the flange, as the log tells it, where that is not its own name."""


class LinkTouch(msgspec.Struct, frozen=True):
    """A link that touches a surface."""

    link: str
    """The name of the link in the URDF."""
    surface: str
    point: Vector
    """Where (mm, in the base)."""
    force: Vector
    """What acts on the link there (N, in the base)."""


def touches_of(contacts: tuple[LinkContact, ...]) -> tuple[LinkTouch, ...]:
    """Contacts as they are told."""
    if not contacts:  # as in most ticks of a robot that is recorded
        return ()
    return tuple(
        LinkTouch(link, surface, (1e3 * point[0], 1e3 * point[1], 1e3 * point[2]), force)
        for link, surface, point, force in contacts
    )


class Meetings:
    """Which links touch surfaces, or each other."""

    def __init__(self, load: ExternalLoad, tick_s: float, tell: Callable[[str], None]) -> None:
        """`tell` takes one line for each meeting that begins."""
        self._load = load
        self._tell = tell
        self.every = max(1, round(SELF_COLLISION_EVERY_S / tick_s))
        """Ticks between two looks at links that may meet each other."""
        self.touching: set[tuple[str, str]] = set()
        """Links that touch surfaces, by their names."""
        self._folded: tuple[str, str] | None = None

    def after_tick(self, tick: int, moved: bool) -> None:
        """A tick of this number has come to an end, and has perhaps moved the arm.

        To be called after ticks in which links touch or have touched, and after each `every` of all.
        """
        contacts = self._load.link_contacts
        if contacts or self.touching:
            touching = {(contact.link, contact.surface) for contact in contacts}
            for link, surface in sorted(touching - self.touching):
                self._tell(harmless(f"{self._named(link)} touches {self._kind(surface)} {surface!r}"))
            self.touching = touching
        if moved and tick % self.every == 0:
            folded = self._load.itself.colliding
            if folded is not None and folded != self._folded:
                self._tell(f"links {folded[0]} and {folded[1]} collide")
            self._folded = folded

    def _named(self, what: str) -> str:
        return f"link {what}" if what in self._load.arm_links else NAMED.get(what, what)

    def _kind(self, name: str) -> str:
        return "surface" if name in self._load.world.surfaces else "part"
