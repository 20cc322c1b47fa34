# For kernels that call these as C functions.
cdef double spline(double[::1] controls, Py_ssize_t cell, double part) noexcept
cdef double part_at(double[::1] controls, Py_ssize_t k, double x) noexcept
cpdef double shape(double v, double rho, double height, int order) noexcept
cdef double corner_part(double x, double first_x, double second_x, double rho, double height) noexcept
