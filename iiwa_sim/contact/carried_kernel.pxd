# For the kernels of a crowd.
from iiwa_sim.contact.balance_kernel cimport Balance

cdef class Carried(Balance):
    cdef Py_ssize_t[::1] _on           # the body on which each part lies, or -1
    # Of parts that may move: the next of these that carries each or -1, how many do, and in which order what
    # carries comes before what is carried.
    cdef Py_ssize_t[::1] _carrier
    cdef Py_ssize_t[::1] _level
    cdef Py_ssize_t[::1] _order
    cdef void _rest_on(self, Py_ssize_t n, double mass, double more, double about) noexcept
    cdef bint _carries(self, Py_ssize_t n, Py_ssize_t o) noexcept
    cdef double _far(self, Py_ssize_t n) noexcept
    cdef double _far_with(self, Py_ssize_t n) noexcept
    cdef object _join(self)
    cdef object _widen(self)
    cdef object _pile(self)
    cdef void _begin(self) noexcept
    cdef void _put(self, double share) noexcept
    cdef double _farther_out(self) noexcept
