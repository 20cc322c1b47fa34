# For kernels that call this as a C function.
cpdef Py_ssize_t fit(
    double[:, ::1] joints, double[:, ::1] weights, bint alone, double[:, ::1] coefficients
) noexcept
