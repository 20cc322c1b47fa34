# For kernels that call these as C functions.
cpdef double arctangent(double y, double x) noexcept
