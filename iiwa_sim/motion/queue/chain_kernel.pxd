# For kernels that follow a way: `find`, `at`, then what lies in `here`.
cdef class JointPath:
    cdef double[::1] edges             # x where third derivatives over x jump, or may change fast, rising
    cdef double[::1] targets
    cdef double[::1] before
    cdef double[::1] after
    cdef double[::1] rho
    cdef double[::1] heights
    cdef double[:, ::1] starts         # where moves begin, by their polynomials
    cdef list paths                    # a Polynomial of each move
    cdef double[:, :, ::1] limits
    cdef double[:, :, ::1] here        # q, dq/dx, d2q/dx2, d3q/dx3 (4, 1, n), after `at`
    cdef double[:, :, ::1] other
    cdef readonly Py_ssize_t joint_count
    cdef readonly double first_x
    cdef readonly double end_x
    cdef Py_ssize_t find(self, double x, Py_ssize_t k) noexcept
    cdef Py_ssize_t corner_at(self, double x, Py_ssize_t k) noexcept
    cdef bint is_straight(self, Py_ssize_t k) noexcept
    cdef Py_ssize_t at(self, double x, Py_ssize_t k, int order) noexcept
    cdef double _place(self, Py_ssize_t c, double v) noexcept
    cdef double limit(self, Py_ssize_t k, Py_ssize_t c, int order, Py_ssize_t joint) noexcept
