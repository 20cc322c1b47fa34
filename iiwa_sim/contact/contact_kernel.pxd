# For the kernel of the world.
cdef (double, double, double) turn_between(double[::1] before, double[::1] after) noexcept

cdef class Contact:
    cdef readonly object surface
    cdef readonly bint touched         # by the TCP where it has been last
    cdef public double unpressed       # so much of how deep the TCP is presses nothing, less as it comes out (m)
    cdef double _radius
    cdef double _reach_squared
    cdef double _stiffness
    cdef double _damping
    cdef double _friction
    cdef bint _is_plane
    cdef bint _is_box
    cdef double _half_x                # of a box (m)
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
    # The anchor (m), if there is one.
    cdef bint _anchored
    cdef double _ax
    cdef double _ay
    cdef double _az
    # Which way was out where the TCP has been last.
    cdef double _ux
    cdef double _uy
    cdef double _uz
    # What the surface does.
    cdef double fx
    cdef double fy
    cdef double fz
    cdef double tx
    cdef double ty
    cdef double tz
    # Of a shape that is no plane: the TCP in its frame when it was felt last, and by which way it has come in.
    cdef bint _known
    cdef double _wx
    cdef double _wy
    cdef double _wz
    cdef object _came
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
    cdef void roll(self, double wx, double wy, double wz) noexcept
    cdef bint press(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember
    ) except? -1
    cdef void _find_depth(self, double px, double py, double pz, bint remember) except *
    cdef object _come(self, object came)
    cdef bint _is_behind(self, double x, double y, double z) noexcept
