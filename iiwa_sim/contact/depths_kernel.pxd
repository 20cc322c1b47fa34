# For the kernels that have parts meet.
from iiwa_sim.contact.bodies_kernel cimport Bodies

cdef class Depths(Bodies):
    # Of parts that may move: their number among these, and the way that is tried; where that ends with those
    # of what carries them, and cosine and sine of the angle.
    cdef Py_ssize_t[::1] _slot
    cdef double[:, ::1] _t
    cdef double[:, ::1] _e
    cdef double[:, ::1] _turn
    # What moves each place, from its `_i` 4 to its `_i` 5: of each part that does, its number, the place; -1
    # for the body whose place it is and 1 for the other, lever (2), how its angle changes the depth.
    cdef Py_ssize_t[:, ::1] _of
    cdef double[:, ::1] _moved
    # What each of these adds to the depth at the ways that are tried, and how deep all before it make that.
    cdef double[::1] _adds
    cdef double[::1] _before
    cdef double _brought               # how far (m) the arm has brought what it holds in this tick
    cdef double[::1] _by               # and its middle (m, in the base)
    cdef double _touch(self, Py_ssize_t n, bint moved, bint plane) except? -1e300
    cdef (double, double, double) _seen(
        self, Py_ssize_t y, double co, double s, double ex, double ey, double ez
    ) noexcept
    cdef double _depth(self, Py_ssize_t m) noexcept
    cdef void _find_depth(self, Py_ssize_t m) noexcept
    cdef double _depth_with(self, Py_ssize_t q) noexcept
    cdef (double, double, double) _rub(self, Py_ssize_t m) noexcept
