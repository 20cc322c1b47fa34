# For kernels that call these as C functions.
cdef double distance(double[:, ::1] fixed, double[::1] centre, double[:, ::1] joints, Py_ssize_t row) noexcept
