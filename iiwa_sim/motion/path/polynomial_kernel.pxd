# For kernels that call these as C functions.
cpdef Py_ssize_t piece_at(double[::1] borders, double s) noexcept
cpdef void evaluate(
    double[::1] borders, Py_ssize_t[::1] offsets, double[:, ::1] coefficients, Py_ssize_t piece, double s,
    int orders, double[:, :, ::1] values, Py_ssize_t row
) noexcept
