# For kernels that call these as C functions.
cpdef int solve(
    double[::1] numbers, double[:, ::1] poses, Py_ssize_t row, double redundancy, int status, double[::1] seed,
    double aligned, double[:, ::1] joints
) noexcept
cpdef int branch(double[::1] numbers, double[::1] q, double[::1] distances) noexcept
