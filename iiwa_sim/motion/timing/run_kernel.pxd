# For kernels that call this as a C function.
cdef double root(double x) noexcept
