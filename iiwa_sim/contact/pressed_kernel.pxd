# For the kernel of a crowd.
from iiwa_sim.contact.stored_kernel cimport Stored

cdef class Pressed(Stored):
    cdef readonly object unpressed     # how deep (m) the held part is in others without pressing, by part and place
    cdef readonly object left          # and links, tool or jaws, from now on: part, link, depth
    cdef readonly object pressed       # the numbers of parts on which links, tool or jaws press
    cdef char[::1] _lies
    cdef object _balls                 # by the parts on which they press
    cdef object _of_the_arm(self, Py_ssize_t n)
    cdef object _leave(self)
