# For kernels that call this as a C function.
cpdef int solve(
    int kind, double[::1] numbers, double[:, ::1] poses, Py_ssize_t row, double redundancy, int status,
    double[::1] seed, double aligned, double[:, ::1] joints
) noexcept
