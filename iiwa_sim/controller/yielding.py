"""A robot that gives way: what its nominal motion and its follower do with stiffness moves and holds."""

from iiwa_sim.controller.wanted import Hold, StiffnessMove, Target, Tracked
from iiwa_sim.motion.compliance_kernel import CartesianImpedance
from iiwa_sim.motion.follower import Follower
from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.nominal import Nominal


class Yielding:
    """The nominal motion of one robot and what follows it, from `start` to `stop`."""

    def __init__(self, nominal: Nominal, follower: Follower) -> None:
        self._nominal = nominal
        self._follower = follower
        self._impedance: CartesianImpedance | None = None  # of a stiffness move that has not set out

    @property
    def begins(self) -> Joints:
        """Where the next stiffness move begins (rad): where the nominal motion is, or in a hold the robot."""
        return self._follower.joints if self._follower.holding else self._nominal.begins

    def start(self) -> None:
        """Yield from now on, where the nominal motion rests."""
        self._follower.start(self._nominal.active.joints)
        self._nominal.begin_stream()

    def replace(self, wanted: StiffnessMove) -> bool:
        """Take a move in place of what runs or waits; says whether it is under way, without a stop.

        If not, it is to be handed to `step` until that takes it.
        """
        if self._follower.holding:
            self._follower.let_go()
            self._nominal.rest_at(self._follower.joints)
            self._nominal.begin_stream()
        replaced = self._nominal.replace(wanted.move)
        self._impedance = wanted.impedance if replaced else None
        return replaced

    def hold(self, wanted: Hold) -> bool:
        """Hold the joints; says whether they are held. If not, it is to be handed to `step` until it takes
        it, since what runs is being stopped."""
        if self._follower.holding:
            self._follower.hold(wanted.stiffness_nm_per_rad)
            return True
        if self._nominal.moving:
            self._nominal.stop()
        return False

    def step(self, waits: StiffnessMove | Hold | Target | Tracked | None) -> bool:
        """A tick, in which what waits begins if the nominal motion is at rest; says whether it does."""
        nominal, follower = self._nominal, self._follower
        begins = waits is not None and not nominal.moving
        if begins:
            match waits:
                case Hold(stiffness_nm_per_rad=stiffness):
                    follower.hold(stiffness)
                case StiffnessMove(move=move, impedance=impedance):
                    nominal.begin(move)
                    self._impedance = impedance
        if not follower.holding:
            nominal.step()
            if self._impedance is not None and not nominal.drive.waiting:
                follower.impedance, self._impedance = self._impedance, None
        follower.step(nominal.active.joints)
        return begins

    def stop(self) -> None:
        """Be stiff, or brake to be so: off the plan that is done from the velocity the robot has, and then
        the nominal motion rests where it comes to rest."""
        if self._follower.off_plan:
            self._nominal.rest_at(self._follower.rest_after_stop())
        self._follower.stop()
        self._impedance = None
