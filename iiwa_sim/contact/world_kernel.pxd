# For the kernel of loads, which feels the world in each tick.
from iiwa_sim.robot.feeling_kernel cimport Feeling

cdef class World(Feeling):
    cdef readonly double radius_m
    cdef readonly int changes          # how many times a surface has been put or taken away
    cdef dict _contacts                # by name
    cdef list _all                     # the same
    cdef double[::1] _turned           # how the TCP is turned, row by row, if that is known
    cdef bint _is_turned
    cdef double[::1] _coming
    cdef void roll_to(self, double[::1] rotation) noexcept
    cpdef bint feel_at(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember
    ) except? -1
