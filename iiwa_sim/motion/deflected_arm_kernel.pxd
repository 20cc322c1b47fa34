# For the kernel of compliance.
from iiwa_sim.motion.joint_bounds_kernel cimport JointBounds
from iiwa_sim.robot.arm_kernel cimport Kinematics

cdef class DeflectedArm:
    cdef Kinematics kinematics
    cdef JointBounds _bounds
    cdef object _weights
    cdef object joints                 # where the arm is (rad)
    cdef object planned                # where the plan is (rad)
    cdef double[::1] at                # of the plan: the rotation of the TCP in the base, row by row, and its place (m)
    cdef double redundancy             # of the plan (rad)
    cdef double[::1] turned            # the rotation of the TCP in the base, of the arm
    cdef object plan(self, object planned)
    cdef bint follow(self, double[::1] x, object before) except? -1
    cdef object force_of(self, object torques)
    cdef void _turn(self, double a, double b, double c) noexcept
    cdef object _follow_within_bounds(self, object before, object wanted, double redundancy)
    cdef object _find_deflection(self, double[::1] x)
