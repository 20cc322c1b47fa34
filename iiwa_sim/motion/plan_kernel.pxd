# For kernels that have a path.
cdef class Polynomial:
    cdef readonly object borders
    cdef readonly object offsets
    cdef readonly object coefficients
    cdef readonly object start
    cdef readonly object end
    cdef readonly object tcp_length_m
    cdef readonly Py_ssize_t joint_count
    cdef readonly bint straight
    cdef readonly Py_ssize_t piece_count
    cdef double[::1] _borders
    cdef Py_ssize_t[::1] _offsets
    cdef double[:, ::1] _coefficients
    cdef double[:, :, ::1] _room
    cdef void evaluate(self, double s, int orders, double[:, :, ::1] values, Py_ssize_t row) noexcept
    cdef Py_ssize_t _piece_at(self, double s) noexcept
    cdef double inside(self, Py_ssize_t piece, double part) noexcept
    cdef void place(self, double s, double[:, :, ::1] values, Py_ssize_t row) noexcept
