# For kernels that call these as C functions.
cpdef void turn(
    double[:, ::1] joints, Py_ssize_t row, double[::1] present, double[::1] lowest, double[::1] highest
) noexcept
cpdef bint clip(double[:, ::1] joints, Py_ssize_t row, double[::1] lowest, double[::1] highest) noexcept
