# For the kernel of one surface that the TCP touches.
cdef class Entered:
    cdef readonly object surface
    cdef double _radius
    cdef double _reach_squared
    cdef int _kind
    cdef bint _is_plane
    cdef bint _is_box
    cdef double _half_x                # its sizes (m)
    cdef double _half_y
    cdef double _half_z
    # The rotation of the shape, row by row, and its place (m).
    cdef double _r0
    cdef double _r1
    cdef double _r2
    cdef double _r3
    cdef double _r4
    cdef double _r5
    cdef double _r6
    cdef double _r7
    cdef double _r8
    cdef double _ox
    cdef double _oy
    cdef double _oz
    # Which way is out, how deep the TCP is (m), and how far from the base a sphere lies on a plane (m).
    cdef double _nx
    cdef double _ny
    cdef double _nz
    cdef double _depth
    cdef double _height
    # Of a shape that is no plane: the TCP in its frame when it was felt last, and by which way it has come in.
    cdef bint _known
    cdef double _wx
    cdef double _wy
    cdef double _wz
    cdef object _came
    cdef object _next                  # what `_follow` has found for that
    cdef int _axis                     # of a box: of the face by which it has come in, -1 where by none
    cdef double _side
    cdef double _out_x                 # and the way out of that
    cdef double _out_y
    cdef double _out_z
    cdef double _behind
    # And a place in its frame round which nothing touches: how far (m).
    cdef double _gx
    cdef double _gy
    cdef double _gz
    cdef double _gap
    cdef void _find_depth(self, double px, double py, double pz, bint remember) except *
    cdef (double, double, double, double) away(self, double x, double y, double z) except *
    cdef bint _is_off(self, double x, double y, double z) noexcept
    cdef (double, double, double, double) _follow(self, double x, double y, double z) except *
    cdef object _come(self, object came)
    cdef bint _is_behind(self, double x, double y, double z) noexcept
