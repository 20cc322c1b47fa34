# For the steps of a clock.
cdef double limit(double[:, ::1] weights, Py_ssize_t g, double[::1] c, Py_ssize_t k) noexcept
cdef double assemble(
    Py_ssize_t[::1] of, Py_ssize_t[::1] first, double[:, ::1] weights, double[:, ::1] rows, double[::1] c, double mu,
    Py_ssize_t begins, Py_ssize_t ends, Py_ssize_t group, Py_ssize_t last_group, Py_ssize_t fixed, double a, double b,
    double[:, ::1] band, double[::1] right) noexcept
cdef bint solve(double[::1] right, double[:, ::1] band, double[::1] step, Py_ssize_t begins, Py_ssize_t ends,
                Py_ssize_t least, Py_ssize_t most) noexcept
