# For the kernels of what is carried.
cdef class TcpMotion:
    cdef readonly bint still           # whether it is at one pose in all three
    cdef int _known                    # how many of the poses are, but for the one to come
    # Rotation in the base, row by row, and place (m): now, a tick ago, two, and in a tick.
    cdef double[::1] _now
    cdef double[::1] _before
    cdef double[::1] _earlier
    cdef double[::1] _coming
    # In axes of the TCP in the middle of the three: p'' (m/s^2), and R'' (1/s^2), row by row.
    cdef double[::1] _linear
    cdef double[::1] _turning
    cdef double[::1] _of               # moments
    # A weight: force (N), torque (Nm); and a wrench.
    cdef double gx
    cdef double gy
    cdef double gz
    cdef double hx
    cdef double hy
    cdef double hz
    cdef double fx
    cdef double fy
    cdef double fz
    cdef double tx
    cdef double ty
    cdef double tz
    cdef object go_to(self, object pose, double tick_s, object coming)
    cpdef object weight(self, object moments)
    cpdef object wrench(self, object moments)
    cdef object _take_moments(self, object moments)
    cdef void weigh(self, double[::1] moments) noexcept
    cdef void act(self, double[::1] moments) noexcept
    cdef void _differ(
        self, double[::1] first, double[::1] middle, double[::1] last, bint known, double dt
    ) noexcept
