# For kernels that have poses as arrays: rotation, row by row, and place (m).
cdef double farthest(double[::1] before, double[::1] after, double extent_m) noexcept
cdef void take(object pose, double[::1] numbers) except *
cdef void put_together(double[::1] a, double[::1] b, double[::1] both) noexcept
cdef object as_transform(double[::1] pose)
