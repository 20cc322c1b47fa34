# For kernels that call these as C functions.
cpdef double sine(double angle) noexcept
cpdef double cosine(double angle) noexcept
cpdef void sines_and_cosines(double[::1] angles, Py_ssize_t count, double[:, ::1] found) noexcept
