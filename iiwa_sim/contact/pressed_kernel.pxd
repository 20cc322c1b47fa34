# For the kernel of a crowd.
from iiwa_sim.contact.stored_kernel cimport Stored

cdef class Pressed(Stored):
    cdef readonly object unpressed     # how deep (m) the held part is in others without pressing, by part and place
    cdef readonly object left          # and links, tool or jaws, from now on: part, link, depth
    cdef readonly object on_held       # force (N) and torque (Nm) on its middle, by the part in which it is, or itself
    cdef readonly object springs       # `Spring`s of that, by the same
    cdef readonly object pressed       # the numbers of parts on which links, tool or jaws press
    cdef char[::1] _lies
    cdef object _balls                 # by the parts on which they press
    cdef object _of_the_arm(self, Py_ssize_t n)
    cdef bint _is_on(self, Py_ssize_t n) noexcept
    cdef object _tell_the_arm(self)
    cdef object _leave_at(self, Py_ssize_t m)
    cdef object _acts(self, Py_ssize_t m, Py_ssize_t part)
