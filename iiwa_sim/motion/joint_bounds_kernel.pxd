# For kernels that move joints.
cdef class JointBounds:
    cdef double _tick_s
    cdef Py_ssize_t _joint_count
    # Of each joint: the limits of its position, how far it may go in a tick, the room before a limit that is
    # ample for that, and the limits of acceleration and jerk of a stop.
    cdef double[::1] _low
    cdef double[::1] _high
    cdef double[::1] _full
    cdef double[::1] _ample
    cdef double[::1] _acceleration
    cdef double[::1] _jerk
    cpdef bint allow(self, joints, after) except? -1
    cdef double _way(self, double room, Py_ssize_t k) noexcept

cpdef double largest_way(before, after) except? -1.0
cpdef double braking_way(double v, double a, double j) noexcept
