# For the kernel of what is held.
cdef class Gripped:
    cdef readonly object part
    cdef readonly double width_m       # between the jaws
    cdef double _mass
    cdef double _tick
    cdef double[::1] _tcp              # of the TCP
    cdef double[::1] _in               # of the part in that
    cdef double[::1] _was              # of the TCP a tick ago
    cdef double[::1] _at               # of the part, while it is placed
    cdef double[::1] _aside            # where it might be in the TCP, and then in the base
    cdef double[::1] _there
    cdef double _was_x                 # and the place of the part in that
    cdef double _was_z
    cdef bint _placed
    cdef object _pose                  # the same for others, None until they ask
    cdef object _in_tcp
    cdef double[::1] _moments          # of the part, in the TCP
    cdef double[::1] _about            # and about its middle
    cdef double _reach                 # no point of it is farther from the TCP (m)
    cpdef bint stays(self, object tcp, object coming) except? -1
    cdef double way(self, double[::1] tcp, double x, double z, double[::1] now) noexcept
    cdef void _place(self) noexcept
    cdef object _shift(self)
    cdef object _at_middle(self, double fx, double fy, double fz)
    cdef void _go(self, double x, double z, double u, double w) noexcept
    cdef void _stay(self) noexcept
