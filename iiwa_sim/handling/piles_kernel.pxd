# For the kernel of parts that are pushed.

cdef class Piles:
    cdef readonly list names           # of all parts, as the cell orders them
    cdef readonly dict numbers         # and their places among these
    cdef bint _known                   # whether what follows is as it is
    cdef Py_ssize_t _count             # parts in piles, each with all that lies on it right behind it
    cdef Py_ssize_t[::1] _order
    cdef Py_ssize_t[::1] _first        # where what lies on each part, and on that, begins there
    cdef Py_ssize_t[::1] _end          # and ends
    cdef Py_ssize_t[::1] _upper        # the first part that lies on each, or -1
    cdef Py_ssize_t[::1] _next         # the next one on the same, or -1
    cdef Py_ssize_t[::1] _left         # those that are still to be put in order
    cdef double[:, ::1] _mass          # mass, moment of inertia about the vertical through its middle; x, y of that
    cdef list _turned                  # the rotations for which that moment was found
    cdef object _find(self, object bodies, object lying)
    cdef void _climb(self, Py_ssize_t lowest) noexcept
