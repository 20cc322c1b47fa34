# For the kernel of loads.
from iiwa_sim.contact.world_kernel cimport World
from iiwa_sim.robot.arm_kernel cimport Tcp

cdef class TcpTouch:
    cdef World world
    cdef bint known                    # whether it is known what surfaces do
    cdef double[::1] _place            # and where that was (m)
    cdef double[::1] _turned           # how the TCP is turned in the base now, row by row
    cdef double[::1] at                # and where it is (m)
    cdef object go_to(self, Tcp tcp, object joints)
    cdef void be_at(self, double[::1] at) noexcept
    cdef bint stays(self) noexcept
    cdef void roll(self) noexcept
    cdef object feel(self, double tick_s)
    cdef void stay(self) noexcept
    cdef object along(self, double fx, double fy, double fz, double tx, double ty, double tz)
