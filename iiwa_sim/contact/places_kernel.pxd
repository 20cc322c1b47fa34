# For the kernels that push parts.
from iiwa_sim.contact.depths_kernel cimport Depths

cdef class Places(Depths):
    cdef bint _meet(
        self, Py_ssize_t x, Py_ssize_t y, double low, double high, double share, bint rubs, double reach
    ) except *
    cdef bint _is_met(self, Py_ssize_t x, Py_ssize_t y) noexcept
    cdef void _forget_pair(self, Py_ssize_t x, Py_ssize_t y) noexcept
    cdef object _place(
        self, Py_ssize_t x, Py_ssize_t y, long long number, double lx, double ly, double lz, double radius,
        int rim, bint tall, double stiffness, bint rubs, double reach
    )
    cdef void _bring(self, Py_ssize_t n, double side) noexcept
    cdef bint _is_beside(self, Py_ssize_t n) noexcept
