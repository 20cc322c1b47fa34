# For the kernel of the world, and of parts that are pressed by what is held.
from iiwa_sim.contact.entered_kernel cimport Entered

cdef (double, double, double) turn_between(double[::1] before, double[::1] after) noexcept

cdef class Contact(Entered):
    cdef readonly bint touched         # by the TCP where it has been last
    cdef public double unpressed       # so much of how deep the TCP is presses nothing, less as it comes out (m)
    cdef double _stiffness
    cdef double _damping
    cdef double _friction
    cdef bint _leans                   # whether the TCP presses at another place than where it is
    cdef double _lean_x                # there (m)
    cdef double _lean_y
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
    cdef bint is_from_above(self) except? -1
    cdef void lean(self, bint leans, double x, double y) noexcept
    cdef void roll(self, double wx, double wy, double wz) noexcept
    cdef (double, double, double) rubs(
        self,
        double[::1] way,
        double[::1] turn,
        double px,
        double py,
        double pz,
        double wx,
        double wy,
        double wz,
    ) noexcept
    cdef bint press(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember
    ) except? -1
