# For kernels that call these as C functions.
cpdef double sine(double angle) noexcept
cpdef double cosine(double angle) noexcept
