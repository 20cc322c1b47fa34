# For the kernel of the world.
from iiwa_sim.contact.entered_kernel cimport Entered

cdef (double, double, double) turn_between(double[::1] before, double[::1] after) noexcept

cdef class Contact(Entered):
    cdef readonly bint touched         # by the TCP where it has been last
    cdef double _stiffness
    cdef double _damping
    cdef double _friction
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
    cdef void roll(self, double wx, double wy, double wz) noexcept
    cdef bint press(
        self, double px, double py, double pz, double vx, double vy, double vz, bint remember
    ) except? -1
