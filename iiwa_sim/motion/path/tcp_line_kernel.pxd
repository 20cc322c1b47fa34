# For kernels that go along a line: `pose`.
cdef class TcpLine:
    cdef readonly double length_m
    cdef double[::1] _start        # twelve numbers of a pose: rotation, place in m
    cdef double[::1] _sine
    cdef double[::1] _versine
    cdef double[::1] _way          # of the place (m)
    cdef double _angle             # of the turn (rad)
    cpdef void pose(self, double s, double[:, ::1] poses, Py_ssize_t row) noexcept
