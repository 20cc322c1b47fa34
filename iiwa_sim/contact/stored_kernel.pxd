# For the kernel of a crowd.
from iiwa_sim.contact.carried_kernel cimport Carried

cdef class Stored(Carried):
    cdef double _stored                # by springs between bodies (J)
    cdef double _unfelt                # what these have got of the arm, and it does not feel (J)
    cdef double _slower                # of the speed of their ways, what parts have then
    cdef object _bend(self)
    cdef bint _take_plane(self, Py_ssize_t m, bint turns) except? -1
    cdef object _go(self)
    cdef double _press_less(self, double moving) except? -1e300
    cdef double _energy(self, Py_ssize_t k, double share) noexcept
    cdef double _gained(self) except? -1e300
    cdef double _rubs_more(self, Py_ssize_t m) noexcept
    cdef (double, double, double) _held_by_friction(self, Py_ssize_t m) noexcept
    cdef (double, double) _winds(self, Py_ssize_t k, Py_ssize_t j) noexcept
    cdef object _keep(self, Py_ssize_t m)
