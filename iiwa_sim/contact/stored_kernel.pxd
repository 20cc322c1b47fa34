# For the kernel of a crowd.
from iiwa_sim.contact.carried_kernel cimport Carried

cdef class Stored(Carried):
    cdef double _stored                # by springs between bodies (J)
    cdef double _unfelt                # what these have got of the arm, and it does not feel (J)
    cdef double _share                 # of their ways that parts have gone, and of their speed then
    cdef double _slower
    cdef void _rest_on(self, Py_ssize_t n, double mass, double more, double about) noexcept
    cdef object _bend(self)
    cdef bint _take_plane(self, Py_ssize_t m, bint turns) noexcept
    cdef object _go(self)
    cdef double _farther(self, double moving) except? -1.0
    cdef double _energy(self, Py_ssize_t k, double share) noexcept
    cdef double _gained(self, bint winds) noexcept
    cdef (double, double) _winds(self, Py_ssize_t k, Py_ssize_t j, bint winds) noexcept
    cdef object _keep(self, Py_ssize_t m)
