"""LIN: joints along a straight line of the TCP, the redundancy going evenly from start to target.

Where the line is regular the closed-form inverse is fitted as it is. A line stays on the branch it starts on;
where it goes exactly through a singular pose, or begins or ends in one, see `iiwa_sim.motion.path.singular`.
"""

from iiwa_sim.motion.joints import Joints
from iiwa_sim.motion.path.line_kernel import LineJoints
from iiwa_sim.motion.path.piecewise_kernel import Polynomial
from iiwa_sim.motion.path.singular import FREE_AT_START, Stretches
from iiwa_sim.motion.path.tcp_line_kernel import TcpLine
from iiwa_sim.robot.inverse_kernel import Inverse

SMALLEST_PIECE = 1.0 / 128.0
"""In s: a line that needs smaller ones is looked at more closely before."""


def lin(inverse: Inverse, start: Joints, line: TcpLine, target_redundancy: float, status: int) -> Polynomial:
    """Joints along a line from `start` (rad), where it begins, on the branch `status`.

    Raises `LineOutOfReach` and `SingularLine` of `iiwa_sim.motion.path.line_kernel`.
    """
    along = LineJoints(inverse, start, line, target_redundancy)
    if len(inverse.merging_statuses(start, FREE_AT_START)) == 1:
        fitted = along.pieces(0.0, 1.0, status, start, start, SMALLEST_PIECE, near=False)
        if not isinstance(fitted, float):
            borders, pieces = fitted
            end = tuple(pieces[-1].sum(axis=0).tolist())
            return Polynomial(borders, pieces, start, end, line.length_m)
    stretches = Stretches(along, status)
    borders, pieces = stretches.pieces()
    return Polynomial(borders, pieces, start, stretches.end, line.length_m)
